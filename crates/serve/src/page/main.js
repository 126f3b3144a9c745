// The page: log in, views, STOP, and the controls.

import { get, post, logIn, logInAs, logOut, me, may } from "/static/server.js";
import { state, onChange, follow } from "/static/state.js";
import * as now from "/static/now.js";
import * as hand from "/static/hand.js";
import * as scans from "/static/scans.js";
import * as records from "/static/records.js";
import * as rig from "/static/rig.js";

export const $ = (id) => document.getElementById(id);

/** Shows what went wrong, until the next attempt. */
export function complain(error) {
  $("alert").textContent = error.message;
}

/** Does something that the server may refuse. */
export async function attempt(act) {
  $("alert").textContent = "";
  try { await act(); } catch (error) { complain(error); }
}

/** Asks a question, with the lines that it is about; whether the answer is yes. */
export function ask(question, yes, lines = []) {
  $("confirm-text").textContent = question;
  $("confirm-lines").textContent = lines.join("\n");
  $("confirm-lines").hidden = lines.length === 0;
  $("confirm-yes").textContent = yes;
  $("confirm").showModal();
  return new Promise((answer) => {
    const close = (value) => { $("confirm").close(); answer(value); };
    $("confirm-yes").onclick = () => close(true);
    $("confirm-no").onclick = () => close(false);
    $("confirm").oncancel = () => answer(false);
  });
}

/**
 * Drives the array: does `act` with the concerns about the exposure of people that are accepted, at first none. If the server refuses because of such
 * concerns, they are shown, and a yes repeats it.
 */
export async function drive(act) {
  try { return await act([]); } catch (error) {
    if (!error.concerns?.length) throw error;
    if (!await ask("A limit of exposure is not shown to be kept. Is everybody away from there or protected, and is the array to be driven all the same?", "Drive it all the same", error.concerns)) return null;
    return act(error.concerns);
  }
}

const VIEWS = ["now", "hand", "scans", "records", "rig", "people"];

function view() {
  const [name, rest] = location.hash.slice(1).split("/");
  const wanted = me() === null ? "login" : VIEWS.includes(name) ? name : "now";
  for (const one of ["login", ...VIEWS]) $(`view-${one}`).hidden = one !== wanted;
  for (const link of document.querySelectorAll("nav a")) {
    if (link.hash === `#${wanted}`) link.setAttribute("aria-current", "page"); else link.removeAttribute("aria-current");
  }
  if (wanted === "now") now.redraw();
  if (wanted === "hand") hand.redraw();
  if (wanted === "scans") scans.opened();
  if (wanted === "records") records.opened(rest ? decodeURIComponent(rest) : null);
  rig.shown(wanted === "rig");
  if (wanted === "people") people();
}

function controls() {
  const { lease, connected, viewers } = state;
  const mine = lease.holder && lease.holder.id === me()?.id;
  let text = !connected ? "No connection to the server; the page connects again by itself." : mine ? "You have the controls." : lease.holder ? `${lease.holder.name} has the controls.` : "Nobody has the controls.";
  if (lease.taking) text += ` ${lease.taking.name} takes them in a few seconds.`;
  if (mine && lease.asked.length) text += ` ${lease.asked.map((one) => one.name).join(", ")} asks for them.`;
  if (connected && viewers > 1) text += ` ${viewers} pages are open.`;
  if ($("controls").textContent !== text) $("controls").textContent = text;
  $("take").hidden = Boolean(mine) || !may("operator");
  $("release").hidden = !mine;
  $("seize").hidden = !may("admin") || !lease.holder || Boolean(mine);
  $("asked").replaceChildren(...(mine ? lease.asked : []).map((one) => {
    const item = document.createElement("li"), give = document.createElement("button");
    give.type = "button";
    give.textContent = `Hand the controls to ${one.name}`;
    give.onclick = () => attempt(() => post("/api/controls/give", { to: one.id }));
    item.append(give);
    return item;
  }));
}

async function people() {
  $("me").textContent = `You are ${me().name}, ${me().role}.`;
  $("invite").hidden = $("make-token").hidden = $("people").hidden = !may("admin");
  if (!may("admin")) return;
  await attempt(async () => {
    const all = await get("/api/people");
    $("people").replaceChildren(...all.map((one) => {
      const line = document.createElement("p");
      line.className = "buttons";
      line.append(`${one.name}, ${one.role}`);
      if (one.id !== me().id) {
        const end = document.createElement("button");
        end.type = "button";
        end.textContent = `End the session of ${one.name}`;
        end.onclick = () => attempt(async () => { await post(`/api/people/${one.id}/end`); await people(); });
        line.append(end);
      }
      return line;
    }));
  });
}

async function stop() {
  $("alert").textContent = "Stopping…";
  try {
    const { left } = await post("/api/stop");
    $("alert").textContent = left;
  } catch (error) {
    $("alert").textContent = `THE STOP DID NOT REACH THE RIG: ${error.message} Switch off its power.`;
  }
}

function lost() {
  // The session has ended, with the server or by an admin.
  setTimeout(() => get("/api/session").then(() => location.reload()).catch((error) => { if (error.status === 401) location.reload(); else lost(); }), 1000);
}

async function begin() {
  window.addEventListener("hashchange", view);
  // On the press itself, not when the button is let go.
  $("stop").onpointerdown = stop;
  $("stop").onclick = (event) => { if (event.detail === 0) stop(); };
  // Users with passwords are there where other computers may come in, which takes encryption.
  $("by-password").hidden = location.protocol !== "https:";
  $("by-password").onsubmit = (event) => {
    event.preventDefault();
    const { name, password } = $("by-password").elements;
    attempt(async () => { await logInAs(name.value, password.value); password.value = ""; await enter(); });
  };
  try {
    await logIn();
  } catch (error) {
    if (error.status !== 401) complain(error);
    view();
    return;
  }
  await enter();
}

async function enter() {
  $("stop").disabled = false;
  onChange(controls);
  now.begin();
  hand.begin();
  scans.begin();
  records.begin();
  rig.begin();
  $("take").onclick = () => attempt(() => post("/api/controls/take"));
  $("release").onclick = () => attempt(() => post("/api/controls/release"));
  $("seize").onclick = () => attempt(async () => { if (await ask(`Take the controls from ${state.lease.holder.name}? They are warned, and lose them after 10 s.`, "Take")) await post("/api/controls/seize"); });
  $("log-out").onclick = () => attempt(async () => { await logOut(); location.reload(); });
  $("invite").onsubmit = (event) => {
    event.preventDefault();
    const { name, role } = $("invite").elements;
    attempt(async () => {
      const { path, minutes } = await post("/api/links", { name: name.value, role: role.value });
      $("link").textContent = `${location.origin}${path} – for one log-in, within ${minutes} minutes`;
      await people();
    });
  };
  $("make-token").onsubmit = (event) => {
    event.preventDefault();
    const { name, role, hours } = $("make-token").elements;
    attempt(async () => {
      const { token } = await post("/api/tokens", { name: name.value, role: role.value, minutes: Math.round(60 * Number(hours.value)) });
      $("token").textContent = `Authorization: Bearer ${token} – shown this once`;
      await people();
    });
  };
  state.rig = await get("/api/rig");
  $("rig-name").textContent = state.rig.name;
  follow(lost, () => state.lease.holder?.id === me().id);
  view();
}

begin();
