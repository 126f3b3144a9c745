// Operation by hand.

import { post, me } from "/static/server.js";
import { state, onChange } from "/static/state.js";
import { figure, drawPlace } from "/static/map.js";
import { ask, attempt, complain, drive, $ } from "/static/main.js";

// The server ends a jog 250 ms after the last heartbeat.
const HEARTBEAT_MS = 80;
const KEYS = { ArrowLeft: ["x", -1], ArrowRight: ["x", 1], ArrowDown: ["y", -1], ArrowUp: ["y", 1], PageUp: ["z", 1], PageDown: ["z", -1] };

let held = null, placeAt = null;
const order = (body) => post("/api/hand/order", body);

/** An order that drives the array; the levels where people are stay on the page while it sounds. */
async function sound(body) {
  const answer = await drive((accepts) => order({ ...body, accepts }));
  if (answer) $("hand-exposure").textContent = answer.exposure?.text ?? "";
}

function hold(axis, sign, button) {
  if (held || !state.hand.open) return;
  if ($("jog-mode").value === "step") {
    attempt(() => order({ order: "step", axis, by_mm: sign * Number($("jog-step").value) }));
    return;
  }
  const number = Date.now();
  let waiting = false;
  const beat = () => {
    if (waiting) return;
    waiting = true;
    const speed_mm_s = sign * Number($("jog-speed").value);
    post("/api/hand/jog", { order: "jog", hold: number, axis, speed_mm_s })
      .catch((error) => { if (held?.number === number) { letGo(); complain(error); } })
      .finally(() => { waiting = false; });
  };
  held = { number, timer: setInterval(beat, HEARTBEAT_MS), button };
  button?.classList.add("held");
  beat();
}

function letGo() {
  if (!held) return;
  const { number, timer, button } = held;
  clearInterval(timer);
  button?.classList.remove("held");
  held = null;
  // If this is lost, the missing heartbeats end the jog.
  post("/api/hand/jog", { order: "release", hold: number }).catch(() => {});
}

const numbers = (form, names) => names.map((name) => Number(form.elements[name].value));

function way() {
  const target = numbers($("go"), ["x", "y", "z"]);
  const at = state.hand.at_mm;
  const rig = state.rig;
  if (!rig || $("view-hand").hidden) return;
  $("hand-place").figure ??= figure($("hand-place"), "Place of the robot, and its way to the place asked for");
  placeAt = drawPlace($("hand-place").figure.canvas, rig, at, target.every(Number.isFinite) ? target : null);
  const outside = rig.travel_mm.some(([low, high], k) => target[k] < low || target[k] > high);
  const length = at ? Math.hypot(...target.map((mm, k) => mm - at[k])) : null;
  $("go-way").textContent = outside ? "This place is outside the travel of the robot." : length === null ? "" : `Straight, ${length.toFixed(1)} mm, about ${(length / rig.feed_mm_s).toFixed(1)} s.`;
}

function show() {
  const { hand, lease, scan } = state;
  const mine = lease.holder?.id === me()?.id, scanning = scan && ["scanning", "paused", "reporting"].includes(scan.stage);
  let text = hand.open ? `The robot ${hand.doing}.` : scanning ? "A scan is using the rig." : mine ? "The rig is closed." : "Take the controls to operate the rig.";
  if (hand.open) {
    if (hand.at_mm) text += ` Place: ${hand.at_mm.map((mm) => mm.toFixed(2)).join(", ")} mm.`;
    if (typeof hand.level === "number") text += ` Level: ${hand.level.toPrecision(4)} ${hand.unit}.`;
    text += hand.focus_mm ? ` THE ARRAY EMITS, ${hand.seconds_left ?? 0} s left.` : " The array is silent.";
    if (hand.problem) text += ` ${hand.problem}`;
  }
  const { sample, axis } = hand;
  const read = sample ? `${sample.mean.toPrecision(5)} ± ${(sample.std / Math.sqrt(sample.count)).toPrecision(2)} ${hand.unit}; standard deviation ${sample.std.toPrecision(3)} ${hand.unit}, ${sample.count} samples${sample.clipped ? "; CLIPPED" : ""}` : "";
  if ($("sample-result").textContent !== read) $("sample-result").textContent = read;
  $("axis").hidden = !axis;
  if ($("axis").textContent !== (axis ?? "")) $("axis").textContent = axis ?? "";
  if ($("hand-state").textContent !== text) $("hand-state").textContent = text;
  $("hand-exposure").hidden = !hand.focus_mm || !$("hand-exposure").textContent;
  $("hand-open").disabled = hand.open || !mine || scanning;
  const operable = hand.open && mine;
  for (const button of document.querySelectorAll("#hand-close, #hand-home, #jog button, #go button, #focus button, #sample button, #find-axis button")) button.disabled = !operable;
  way();
}

export const redraw = show;

/** Puts a place into the form, where its way is shown before anybody goes there. */
export function propose(place) {
  ["x", "y", "z"].forEach((name, k) => { if (place[k] !== undefined) $("go").elements[name].value = place[k].toFixed(2); });
  way();
}

export function begin() {
  onChange((kind) => { if (["all", "hand", "lease", "progress", "scan", "rig"].includes(kind)) show(); });
  $("hand-open").onclick = () => attempt(() => post("/api/hand/open"));
  $("hand-close").onclick = () => attempt(() => post("/api/hand/close"));
  $("hand-home").onclick = () => attempt(() => order({ order: "home" }));
  $("silence").onclick = () => attempt(() => order({ order: "silence" }));
  $("hand-place").onclick = (event) => {
    const box = event.target.getBoundingClientRect(), place = placeAt?.(event.clientX - box.left, event.clientY - box.top);
    if (place) propose(place);
  };
  $("go").oninput = way;
  $("go").onsubmit = (event) => { event.preventDefault(); attempt(() => order({ order: "go", to_mm: numbers($("go"), ["x", "y", "z"]) })); };
  $("focus").onsubmit = (event) => {
    event.preventDefault();
    const form = $("focus"), [seconds] = numbers(form, ["seconds"]);
    attempt(() => sound({ order: "focus", at_mm: numbers(form, ["x", "y", "z"]), seconds, continuous: form.elements.continuous.checked }));
  };
  $("sample").onsubmit = (event) => { event.preventDefault(); attempt(() => order({ order: "sample", samples: numbers($("sample"), ["samples"])[0] })); };
  $("find-axis").onsubmit = (event) => {
    event.preventDefault();
    const form = $("find-axis"), heights_mm = form.elements.heights.value.split(",").map(Number), [reach_mm] = numbers(form, ["reach"]);
    attempt(async () => { if (await ask(`The array emits, and the robot scans crosses at ${heights_mm.join(", ")} mm, up to ${reach_mm} mm to each side. Begin?`, "Begin")) await sound({ order: "find-axis", heights_mm, reach_mm }); });
  };
  for (const button of document.querySelectorAll("#jog button")) {
    button.onpointerdown = (event) => { button.setPointerCapture(event.pointerId); hold(button.dataset.axis, Number(button.dataset.sign), button); };
    button.onpointerup = button.onpointercancel = button.onlostpointercapture = letGo;
    button.oncontextmenu = (event) => event.preventDefault();
    // The keyboard holds a focused button as the mouse does.
    button.onkeydown = (event) => { if ([" ", "Enter"].includes(event.key)) { event.preventDefault(); hold(button.dataset.axis, Number(button.dataset.sign), button); } };
    button.onkeyup = letGo;
  }
  document.addEventListener("keydown", (event) => {
    if ($("view-hand").hidden || !KEYS[event.key] || event.target.closest("input, select, textarea")) return;
    event.preventDefault();
    if (!event.repeat) hold(...KEYS[event.key], null);
  });
  document.addEventListener("keyup", (event) => { if (KEYS[event.key]) letGo(); });
  // Whatever hides the page ends the jog.
  for (const end of ["blur", "pagehide"]) window.addEventListener(end, letGo);
  document.addEventListener("visibilitychange", letGo);
}
