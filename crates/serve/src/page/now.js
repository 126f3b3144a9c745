// The view of the running scan.

import { post, may, me } from "/static/server.js";
import { state, onChange } from "/static/state.js";
import { figure, drawMap, drawPlace, drawTrace } from "/static/map.js";
import { propose } from "/static/hand.js";
import { attempt, $ } from "/static/main.js";

let figures = null, shown = null, chosen = { folder: null, height: null, drive: null }, toMm = null, drawn = false;

const SAME_HEIGHT_MM = 0.5;

/** The height of a reading, by its number in the plan. */
const heightOf = (z) => state.scan.heights.findIndex((height) => Math.abs(height.z_mm - z) <= SAME_HEIGHT_MM);

/** Fits the choices to the scan: the newest reading's, until somebody chooses. */
function choices() {
  const { scan } = state;
  const newest = [...scan.readings].reverse().find((reading) => reading[1] >= 0);
  if (chosen.folder !== scan.folder) chosen = { folder: scan.folder, height: null, drive: null };
  const height = chosen.height ?? (newest ? Math.max(heightOf(newest[2][2]), 0) : 0);
  const drive = chosen.drive ?? (newest ? newest[1] : 0);
  const fill = (select, options, value) => {
    const wanted = options.map(([key, text]) => `${key}:${text}`).join();
    if (select.dataset.options !== wanted) {
      select.dataset.options = wanted;
      select.replaceChildren(...options.map(([key, text]) => new Option(text, key)));
    }
    select.value = String(value);
  };
  fill($("height"), scan.heights.map((one, k) => [k, `${one.z_mm.toFixed(1)} mm`]), height);
  const drives = [...new Set(scan.readings.map((reading) => reading[1]))].filter((one) => one >= 0).sort((a, b) => a - b);
  fill($("drive"), drives.map((one) => [one, `${one}`]), drive);
  return { height, drive };
}

function maps() {
  const { scan } = state;
  $("maps").hidden = $("map-choice").hidden = !scan || scan.heights.length === 0;
  if ($("maps").hidden) return;
  figures ??= ["Scan", "Simulation, scaled to the scan", "Scan − simulation"].map((label) => figure($("maps"), label));
  const { height, drive } = choices();
  const rectangle = scan.heights[height];
  const at = scan.readings.filter((reading) => reading[1] === drive && Math.abs(reading[2][2] - rectangle.z_mm) <= SAME_HEIGHT_MM);
  // The gain that fits the simulation to the scan best, by least squares.
  const [product, square] = at.reduce(([p, s], reading) => [p + reading[3] * reading[4], s + reading[4] ** 2], [0, 0]);
  const gain = square > 0 ? product / square : 0;
  const most = at.reduce((largest, reading) => Math.max(largest, reading[3]), 0) || 1;
  const db = $("scale").value === "db";
  const value = (linear) => db ? 20 * Math.log10(Math.max(linear, 1e-6 * most) / most) : linear;
  const range = db ? [-30, 0] : [0, most];
  const points = (of) => at.map((reading) => [reading[2][0], reading[2][1], of(reading)]);
  toMm = drawMap(figures[0].canvas, points((r) => value(r[3])), range, rectangle, false);
  drawMap(figures[1].canvas, points((r) => value(gain * r[4])), range, rectangle, false);
  const apart = at.reduce((largest, r) => Math.max(largest, Math.abs(r[3] - gain * r[4])), 0) || 1;
  drawMap(figures[2].canvas, points((r) => r[3] - gain * r[4]), [-apart, apart], rectangle, true);
  const unit = db ? "dB" : scan.unit;
  figures[0].caption.textContent = `Scan: ${range[0]} (dark) to ${Number(range[1].toPrecision(3))} ${unit}`;
  figures[1].caption.textContent = "Simulation, scaled to the scan; the same colours";
  figures[2].caption.textContent = `Scan − simulation: ±${apart.toPrecision(3)} ${scan.unit}`;
  shown = { at, gain };
}

function progress() {
  const { scan } = state;
  const words = { scanning: "Scanning", paused: "Paused, the array silent", reporting: "Measured; the report is being written", ended: "Ended" };
  const done = scan ? scan.readings.length : 0;
  $("progress-bar").hidden = !scan || !scan.of;
  if (scan) {
    $("progress-done").max = Math.max(scan.of, 1);
    $("progress-done").value = done;
  }
  let text = "No scan is running.";
  if (scan) {
    text = `${scan.name}: ${words[scan.stage]}. ${done} of ${scan.of} readings`;
    const first = scan.readings[0], last = scan.readings[done - 1];
    if (scan.stage === "scanning" && done > 5 && last[5] > first[5]) {
      const left = (last[5] - first[5]) / (done - 1) * (scan.of - done);
      text += `, about ${left < 90 ? `${Math.ceil(left)} s` : `${Math.ceil(left / 60)} min`} left on the rig's clock`;
    }
    text += scan.reason ? `. ${scan.reason}` : ".";
  }
  if ($("progress").textContent !== text) $("progress").textContent = text;
  const running = scan && ["scanning", "paused"].includes(scan.stage), mine = state.lease.holder?.id === me()?.id;
  $("scan-buttons").hidden = !running && !scan?.has_report;
  $("pause").hidden = scan?.stage !== "scanning";
  $("continue").hidden = scan?.stage !== "paused";
  $("pause").disabled = $("continue").disabled = !mine;
  $("report-link").hidden = !scan?.has_report;
  if (scan?.has_report) $("report-link").href = `#records/${encodeURIComponent(scan.folder)}`;
}

function place() {
  const { scan, rig, hand } = state;
  if (!rig) return;
  $("place").figure ??= figure($("place"), "Place of the robot in its travel");
  const last = scan?.stage === "scanning" ? scan.readings[scan.readings.length - 1] : null;
  const at = hand.open ? hand.at_mm : last?.[2];
  drawPlace($("place").figure.canvas, rig, at, null);
  $("place-text").textContent = at ? `x ${at[0].toFixed(2)}, y ${at[1].toFixed(2)}, z ${at[2].toFixed(2)} mm (array frame)` : "The place is not known.";
}

function trace() {
  const { scan } = state;
  $("trace").figure ??= figure($("trace"), "Last readings against time");
  const last = scan ? scan.readings.slice(-200) : [];
  drawTrace($("trace").figure.canvas, last.map((reading) => [reading[5], reading[3]]), true);
  const newest = last[last.length - 1];
  $("trace-text").textContent = newest ? `${newest[3].toPrecision(4)} ${scan.unit} at ${newest[5].toFixed(1)} s` : "No readings.";
}

function lines() {
  $("lines").replaceChildren(...[...state.lines].reverse().map((line) => {
    const item = document.createElement("li"), time = document.createElement("time");
    time.dateTime = line.at;
    time.textContent = new Date(line.at).toLocaleTimeString();
    item.append(time, line.text);
    return item;
  }));
}

/** A curve with its caption; hidden without points. */
function curve(name, label, points, caption, fromZero) {
  $(`${name}-column`).hidden = points.length < 2;
  if (points.length < 2) return;
  $(name).figure ??= figure($(name), label);
  drawTrace($(name).figure.canvas, points, fromZero);
  $(name).figure.caption.textContent = caption(points[points.length - 1][1], points);
}

function curves() {
  const readings = state.scan?.readings ?? [], unit = state.scan?.unit;
  const noise = readings.slice(-200).filter((one) => one[6] !== null).map((one) => [one[5], one[6]]);
  curve("noise", "Noise against time", noise, (last) => `Standard deviation of the samples of a reading: ${last.toPrecision(3)} ${unit}`, true);
  const references = (state.scan?.references ?? []).map((row) => readings[row]).filter(Boolean), first = references[0]?.[3];
  const drift = first ? references.map((one) => [one[5], (one[3] / first - 1) * 100]) : [];
  curve("drift", "Drift against time", drift, (last) => `Readings at the reference point against the first: ${last >= 0 ? "+" : "−"}${Math.abs(last).toFixed(2)} %`, false);
  const air = (state.scan?.air ?? []).map((row) => [row.time_s, row.temperature_c]), humid = state.scan?.air?.at(-1)?.humidity_percent;
  curve("air", "Temperature against time", air, (last, all) => `${last.toFixed(2)} °C${humid ? `, ${humid.toFixed(0)} % humidity` : ""}; ${(last - all[0][1]).toFixed(2)} K since the beginning`, false);
}

/** Draws what has changed, once a frame. */
function draw() {
  drawn = false;
  progress();
  if ($("view-now").hidden) return;
  maps();
  place();
  trace();
  curves();
  lines();
  // For tests and for people who measure: which reading is on the map.
  $("maps").dataset.readings = String(state.scan?.readings.length ?? 0);
}

export function redraw() {
  if (drawn) return;
  drawn = true;
  requestAnimationFrame(draw);
}

/** The reading under the cursor. */
function under(event) {
  if (!shown || !toMm) return null;
  const box = event.target.getBoundingClientRect();
  const [x, y] = toMm(event.clientX - box.left, event.clientY - box.top);
  let nearest = null, least = Infinity;
  for (const reading of shown.at) {
    const apart = (reading[2][0] - x) ** 2 + (reading[2][1] - y) ** 2;
    if (apart < least) { least = apart; nearest = reading; }
  }
  return nearest;
}

function cursor(event) {
  const nearest = under(event);
  if (!nearest) return;
  const [rx, ry, rz] = nearest[2], simulated = shown.gain * nearest[4];
  $("cursor").textContent = `(${rx.toFixed(2)}, ${ry.toFixed(2)}, ${rz.toFixed(2)}) mm: scan ${nearest[3].toPrecision(4)}, simulation ${simulated.toPrecision(4)}, difference ${(nearest[3] - simulated).toPrecision(3)} ${state.scan.unit}`;
}

export function begin() {
  onChange(redraw);
  window.addEventListener("resize", redraw);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  $("height").onchange = () => { chosen.height = Number($("height").value); redraw(); };
  $("drive").onchange = () => { chosen.drive = Number($("drive").value); redraw(); };
  $("scale").onchange = redraw;
  $("maps").addEventListener("pointermove", cursor);
  // A click takes the place to the view of operation by hand, where its way is shown.
  $("maps").addEventListener("click", (event) => {
    const nearest = under(event);
    if (nearest && state.hand.open) { location.hash = "#hand"; propose(nearest[2]); }
  });
  $("pause").onclick = () => attempt(() => post("/api/scans/pause"));
  $("continue").onclick = () => attempt(() => post("/api/scans/continue"));
  if (!may("operator")) $("pause").title = "for operators";
}
