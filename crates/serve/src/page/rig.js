// The devices: their check, their wires, the camera.

import { get, post, me } from "/static/server.js";
import { state, onChange } from "/static/state.js";
import { attempt, $ } from "/static/main.js";

const DEVICES = [["focus_array", "focus array", "Array"], ["receiver", "receiver", "Receiver"], ["motion", "robot", "Robot"], ["environment", "environment", "Air sensor"]];
const WIRES_EVERY_MS = 2000;

/** What a device says of itself, in words. */
function words(key, found) {
  if (!found) return "no answer";
  const latency = found.latency ? `, answers in ${found.latency.median_ms.toFixed(1)} ms` : "";
  switch (key) {
    case "focus_array": return `${found.identity.name ?? "controller"}, ${found.identity.elements} elements, on ${found.port}${latency}`;
    case "receiver": return `${found.identity.rate_hz} Hz, up to ${found.identity.full_scale} ${found.identity.unit}, reads ${found.silent.mean.toPrecision(3)} ${found.identity.unit} in silence, on ${found.port}${latency}`;
    case "motion": return `${found.firmware}, on ${found.port}${latency}`;
    default: return `on ${found.port}`;
  }
}

async function check() {
  $("check-state").textContent = "Checking; nothing moves.";
  try {
    const report = await post("/api/rig/check");
    const shown = DEVICES.filter(([key]) => key !== "environment" || report[key]);
    $("lights").replaceChildren(...shown.map(([key, role, name]) => {
      const findings = report.findings.filter((one) => one.device.replace(/[-_]/g, " ") === role || one.device === key);
      const worst = !report[key] || findings.some((one) => one.severity === "fault") ? "fault" : findings.length ? "warning" : "good";
      const item = document.createElement("li"), light = document.createElement("strong");
      light.className = `light ${worst}`;
      light.textContent = { good: "good", warning: "warning", fault: "FAULT" }[worst];
      item.append(light, ` ${name}: ${words(key, report[key])}.`);
      for (const one of findings) {
        const advice = document.createElement("p");
        advice.textContent = `${one.problem}: ${one.remedy}.`;
        item.append(advice);
      }
      return item;
    }));
    $("check-state").textContent = report.findings.some((one) => one.severity === "fault") ? "No scan is possible." : "A scan is possible.";
  } catch (error) {
    $("check-state").textContent = "";
    throw error;
  }
}

async function wires() {
  if ($("view-rig").hidden || !me()) return;
  const all = await get("/api/rig/wires");
  for (const { device, lines } of all) {
    const { title, text } = shownWires.get(device) ?? wire(device);
    title.textContent = `${device}: ${lines.length} lines`;
    text.textContent = lines.join("\n");
  }
  $("no-wires").hidden = shownWires.size > 0;
}

/** The place of a device's lines. It stays, so that an open one stays open and keeps its focus. */
function wire(device) {
  const outer = document.createElement("details"), title = document.createElement("summary"), text = document.createElement("pre");
  text.tabIndex = 0;
  text.setAttribute("aria-label", `Wire of the ${device}`);
  outer.append(title, text);
  $("wires").append(outer);
  shownWires.set(device, { title, text });
  return { title, text };
}

const shownWires = new Map();

function buttons() {
  $("check").disabled = state.lease.holder?.id !== me()?.id || state.hand.open || ["scanning", "paused"].includes(state.scan?.stage);
}

/** Shows the camera only while the view is open, so that it streams to nobody else. */
export function shown(visible) {
  const address = state.rig?.camera;
  if (visible && address) {
    const frame = document.createElement("iframe");
    frame.title = "Camera";
    frame.setAttribute("sandbox", "allow-scripts allow-same-origin");
    frame.src = address;
    $("camera").replaceChildren(frame);
  } else {
    $("camera").replaceChildren();
  }
  if (visible) { buttons(); attempt(wires); }
}

export function begin() {
  onChange(buttons);
  $("check").onclick = () => attempt(check);
  setInterval(() => wires().catch(() => {}), WIRES_EVERY_MS);
}
