// Plans, their dry runs, and the queue.

import { get, post, me, may } from "/static/server.js";
import { state, onChange } from "/static/state.js";
import { attempt, ask, drive, $ } from "/static/main.js";

let open = null, replaces = null;

const duration = (seconds) => seconds < 90 ? `${Math.ceil(seconds)} s` : `${Math.ceil(seconds / 60)} min`;

function inWords({ check, programs }) {
  let text = `${check.visits} readings, ${check.dark} of them with the array silent. Path of the robot ${check.way_m.toFixed(1)} m, about ${duration(check.about_s)} on the rig's clock.`;
  if (programs.length) text += ` The plan names programs (${programs.join("; ")}); a scan started here runs them only if they were agreed to on the command line.`;
  return text;
}

async function list() {
  const plans = await get("/api/plans");
  $("plans").replaceChildren(...plans.map((plan) => {
    const item = document.createElement("li"), button = document.createElement("button");
    button.type = "button";
    button.textContent = plan.fault ? `${plan.name}: not possible` : plan.name;
    button.onclick = () => plan.fault ? attempt(() => { throw new Error(plan.fault); }) : attempt(() => show(plan.name));
    item.append(button);
    return item;
  }));
}

async function show(name) {
  open = await get(`/api/plans/${encodeURIComponent(name)}`);
  $("plan").hidden = false;
  $("plan-form").hidden = true;
  $("plan-name").textContent = open.name;
  $("plan-check").textContent = inWords(open);
  $("plan-exposure").hidden = !open.exposure;
  $("plan-exposure").textContent = open.exposure ? [open.exposure.text, ...open.exposure.concerns].join("\n") : "";
  $("plan-text").textContent = open.text;
  buttons();
}

function buttons() {
  const mine = state.lease.holder?.id === me()?.id;
  $("start").disabled = !mine || state.hand.open;
  $("start").title = mine ? "" : "take the controls first";
  $("edit").hidden = $("new-plan").hidden = !may("operator");
}

async function start() {
  const { name, digest } = open;
  const homes = state.rig.virtual ? "This rig is virtual." : "The robot homes first, and the array emits ultrasound. Is the path free, and everybody out of the way?";
  if (!await ask(`Start “${name}”? ${inWords(open)} ${homes}`, "Start")) return;
  if (await drive((accepts) => post("/api/scans", { plan: name, digest, accepts }))) location.hash = "#now";
}

function queue() {
  const { waiting = [], running, held } = state.queue;
  const items = [];
  if (running) items.push(Object.assign(document.createElement("p"), { textContent: `Running: ${running.plan}, started by ${running.by}.` }));
  for (const one of waiting) {
    const line = document.createElement("p");
    line.className = "buttons";
    line.append(`Waiting: ${one.plan}, by ${one.by}`);
    for (const [text, act] of [["First", "first"], ["Remove", "remove"]]) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text;
      button.onclick = () => attempt(() => post(`/api/queue/${one.id}/${act}`));
      line.append(button);
    }
    items.push(line);
  }
  if (held && waiting.length) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "The queue is held after a stop: let it go on";
    button.onclick = () => attempt(() => post("/api/queue/continue"));
    items.push(button);
  }
  $("queue").replaceChildren(...items);
  buttons();
}

function edit(name, text, before) {
  replaces = before;
  const form = $("plan-form");
  $("plan").hidden = true;
  form.hidden = false;
  form.elements.name.value = name;
  form.elements.name.readOnly = before !== null;
  form.elements.text.value = text;
  $("plan-fields").hidden = before !== null;
  $("form-check").textContent = "";
}

function fill() {
  const { name, fx, fy, fz, heights, size, step } = $("plan-form").elements;
  const real = (input) => { const number = Number(input.value); return Number.isInteger(number) ? `${number}.0` : `${number}`; };
  const planes = heights.value.split(/[\s,;]+/).filter(Boolean).map((height) =>
    `[[plane]]\nz_mm = ${real({ value: height })}\ncentre_mm = [${real(fx)}, ${real(fy)}]\nsize_mm = [${real(size)}, ${real(size)}]\nstep_mm = ${real(step)}\n`);
  $("plan-form").elements.text.value = `name = ${JSON.stringify(name.value || "scan")}\n\n[simulator]\nmodel = "corrected"\n\n[dark]\nbefore = 2\n\n[[focus]]\nx_mm = ${real(fx)}\ny_mm = ${real(fy)}\nz_mm = ${real(fz)}\n\n${planes.join("\n")}`;
}

const form = () => ({ name: $("plan-form").elements.name.value, text: $("plan-form").elements.text.value });

export function begin() {
  onChange((kind) => { if (["all", "queue", "lease", "hand"].includes(kind)) queue(); });
  $("start").onclick = () => attempt(start);
  $("edit").onclick = () => edit(open.name, open.text, open.text);
  $("new-plan").onclick = () => { edit("", "", null); fill(); };
  $("fill").onclick = fill;
  $("cancel").onclick = () => { $("plan-form").hidden = true; $("plan").hidden = !open; };
  $("dry-run").onclick = () => attempt(async () => { $("form-check").textContent = inWords(await post("/api/plans/check", form())); });
  $("plan-form").onsubmit = (event) => {
    event.preventDefault();
    attempt(async () => {
      await post("/api/plans", { ...form(), ...(replaces === null ? {} : { replaces }) });
      await list();
      await show(form().name);
    });
  };
}

export const opened = () => attempt(list);
