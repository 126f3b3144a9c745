"use strict";

// Draws the maps of a report or of a simulation. Everything is in the page: the data, and the script of Plotly.

const SECTIONS = ["along-x", "along-y", "along-z"];
const LEAST_DECIBELS = -50;
// On a narrow screen the buttons would cover the titles.
const displayModeBar = matchMedia("(max-width: 640px)").matches ? false : "hover";
const CONFIGURATION = { responsive: true, displaylogo: false, displayModeBar, modeBarButtonsToRemove: ["select2d", "lasso2d"] };

/** The colours of a phase: as light everywhere, and the last is the first. "phase" of cmocean (K. M. Thyng et al., Oceanography 29(3), 2016). */
const CYCLIC = ["#a8780d", "#c56033", "#d94360", "#dd26a3", "#c43be0", "#9961f4", "#5f7fe4", "#2890b7", "#0f9788", "#279953", "#778d11", "#a8780d"]
  .map((colour, index, all) => [index / (all.length - 1), colour]);
/** Amplitude, as a share of the largest of a height, below which no phase is shown. */
const LEAST_AMPLITUDE = 0.05;
/** Points of the view in three dimensions, at most. */
const MOST_POINTS_3D = 60000;

function bytes(base64) {
  const text = atob(base64);
  const values = new Uint8Array(text.length);
  for (let index = 0; index < text.length; index += 1) values[index] = text.charCodeAt(index);
  return values;
}

/** Unpacks a script of Plotly and runs it. */
async function loadPlotly(id) {
  const packed = bytes(document.getElementById(id).textContent);
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(unpacked).text();
  document.head.append(script);
}

/** The rows of a map of a plane: "scan", "simulation" or "phase" (degrees). They are unpacked when they are first asked for. */
function rows(plane, name) {
  if (typeof plane[name] === "string") {
    const packed = bytes(plane[name]);
    const values = name === "phase"
      ? Float32Array.from(packed, (step) => (step * 360) / 256 - 180)
      : new Float32Array(packed.buffer);
    const columns = plane.x_mm.length;
    plane[name] = plane.y_mm.map((_, row) => values.subarray(row * columns, (row + 1) * columns));
  }
  return plane[name];
}

function largest(map) {
  let top = 0;
  for (const row of map) for (const value of row) if (value > top && value < Infinity) top = value;
  return top;
}

/** Index of the entry nearest to a place. */
const nearest = (along, at) =>
  along.reduce((best, place, index) =>
    (Math.abs(place - at) < Math.abs(along[best] - at) ? index : best), 0);

/** Row and column of the largest entry. */
function peak(map) {
  const top = largest(map);
  const row = Math.max(0, map.findIndex((values) => values.includes(top)));
  return [row, Math.max(0, map[row].indexOf(top))];
}

/** Text that Plotly shows as it is: it takes some markup in titles. */
const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");

const digits = (value) => (Number.isFinite(value) ? Number(value.toPrecision(4)).toString() : "–");

/** Level of a pressure in Pa rms, dB re 20 µPa. */
const level = (pa) => 20 * Math.log10(pa / 20e-6);

const minus = (text) => text.replaceAll("-", "−");

class Explorer {
  constructor(maps) {
    this.maps = maps;
    this.form = document.querySelector(".controls").elements;
    this.place = null;
    this.zoom = null;
    const options = (select, names) => {
      select.replaceChildren(...names.map((name, index) => new Option(name, String(index))));
      select.parentElement.hidden = names.length < 2;
    };
    const { comparison, drive } = this.form;
    const planes = maps.comparisons.flatMap((one) => one.planes);
    this.isMeasured = planes.some((plane) => plane.scan);
    this.shownMaps = [...document.querySelectorAll("#fields > div")].map(({ id }) => id);
    this.volume = document.getElementById("volume-fold");
    this.volume.addEventListener("toggle", () => this.drawVolume());
    // Whether the whole script is there, which draws in three dimensions: "no", "loading" or "yes".
    this.whole = "no";
    options(comparison, maps.comparisons.map(({ simulator }) => simulator));
    const withMaps = maps.comparisons.findIndex(({ planes }) => planes.length > 0);
    comparison.value = String(withMaps);
    const drives = [...new Set(this.comparison.planes.map((plane) => plane.drive))];
    drive.replaceChildren(...drives.map((number) => new Option(String(number), String(number))));
    drive.parentElement.hidden = drives.length < 2;
    const start = maps.start ?? { drive: drives[0], z_mm: 0 };
    drive.value = String(start.drive);
    this.form.height.max = String(this.planes.length - 1);
    this.form.height.value = String(nearest(this.planes.map((plane) => plane.z_mm), start.z_mm));
    document.querySelector(".controls").addEventListener("input", (event) => {
      if (event.target.name === "drive" || event.target.name === "view") this.zoom = null;
      this.draw();
    });
    document.querySelector(".controls").addEventListener("submit", (event) => event.preventDefault());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  get comparison() {
    return this.maps.comparisons[Number(this.form.comparison.value)];
  }

  /** The planes of the chosen drive, by height. */
  get planes() {
    const drive = Number(this.form.drive.value);
    return this.comparison.planes.filter((plane) => plane.drive === drive).sort((a, b) => a.z_mm - b.z_mm);
  }

  get plane() {
    return this.planes[Number(this.form.height.value)];
  }

  /** Standard deviation of a reading at a level. */
  error(level) {
    const [constant, share] = this.comparison.noise;
    return Math.hypot(constant, share * level);
  }

  /** Whether pascals and levels are shown. */
  get isAbsolute() {
    return ["pascal", "level"].includes(this.form.scale.value);
  }

  /** Whether the scale is logarithmic. */
  get isLogarithmic() {
    return ["decibel", "level"].includes(this.form.scale.value);
  }

  /** What the values of a plane are multiplied with to be shown; a plane without a level has none in pascals. */
  factor(plane) {
    return this.isAbsolute ? plane.level?.pa_per_unit ?? NaN : 1;
  }

  unit() {
    return this.isAbsolute ? "Pa rms" : this.readingUnit();
  }

  readingUnit() {
    return this.maps.unit || (this.isMeasured ? "the receiver's unit" : "simulator's unit");
  }

  layout(title, more) {
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(name).trim();
    const axis = { gridcolor: colour("--faint"), zerolinecolor: colour("--line"), automargin: true };
    const { xaxis, yaxis, ...rest } = more;
    return {
      title: { text: plain(title), font: { size: 14 }, x: 0, xanchor: "left", xref: "paper" },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("--line"), activecolor: colour("--text") },
      margin: { l: 50, r: 10, t: 36, b: 40 },
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: colour("--text"), size: 12 },
      showlegend: false,
      xaxis: { ...axis, ...xaxis },
      yaxis: { ...axis, ...yaxis },
      ...rest,
    };
  }

  /** Values, colour scale and title of one of the maps. */
  shown(name) {
    const { plane, planes, form } = this;
    if (name === "difference") return this.difference();
    if (name === "phase") return this.phase();
    const of = form.range.value === "all" ? planes : [plane];
    const names = this.isMeasured ? ["scan", "simulation"] : ["simulation"];
    const tops = of.flatMap((one) => names.map((map) => largest(rows(one, map)) * this.factor(one)));
    const top = Math.max(0, ...tops.filter(Number.isFinite)) || 1;
    const title = name === "scan" ? "scan" : `simulation (${this.comparison.simulator})`;
    const factor = this.factor(plane);
    const map = factor === 1 ? rows(plane, name) : rows(plane, name).map((row) => row.map((value) => value * factor));
    if (!this.isLogarithmic) {
      return { z: map, zmin: 0, zmax: top, colorscale: "Viridis", title, unit: this.unit() };
    }
    const of_top = this.isAbsolute ? level(top) : 0;
    const decibels = (value) => of_top + Math.max(LEAST_DECIBELS, 20 * Math.log10(Math.max(value, 1e-30) / top));
    const z = map.map((row) => row.map(decibels));
    return { z, zmin: of_top + LEAST_DECIBELS, zmax: of_top, colorscale: "Viridis", title, unit: this.isAbsolute ? "dB re 20 µPa" : "dB" };
  }

  /** The phase of the simulation, left out where the amplitude is small. */
  phase() {
    const { plane } = this;
    const [amplitude, phase] = [rows(plane, "simulation"), rows(plane, "phase")];
    const least = LEAST_AMPLITUDE * largest(amplitude);
    const z = phase.map((row, r) => row.map((value, c) => (amplitude[r][c] >= least ? value : NaN)));
    const tickvals = [-180, -90, 0, 90, 180];
    const colorbar = { tickvals, ticktext: tickvals.map((tick) => minus(String(tick))) };
    return { z, zmin: -180, zmax: 180, colorscale: CYCLIC, title: "phase of the simulation", unit: "degrees", colorbar };
  }

  /** The difference: in the unit, or in standard errors on a scale that never saturates. */
  difference() {
    const [scan, simulation] = [rows(this.plane, "scan"), rows(this.plane, "simulation")];
    // Standard errors have no unit.
    const factor = this.form.difference.value === "unit" ? this.factor(this.plane) : 1;
    const differ = scan.map((row, r) => row.map((value, c) => (value - simulation[r][c]) * factor));
    const colours = { colorscale: "RdBu", title: "scan − simulation" };
    if (this.form.difference.value === "unit") {
      const top = largest(differ.map((row) => row.map(Math.abs))) || 1;
      return { z: differ, zmin: -top, zmax: top, unit: this.unit(), ...colours };
    }
    const errors = differ.map((row, r) => row.map((value, c) => value / this.error(simulation[r][c])));
    const z = errors.map((row) => row.map(Math.asinh));
    const top = largest(z.map((row) => row.map(Math.abs))) || 1;
    const marks = [1, 3, 10, 30, 100, 300, 1000].filter((mark) => Math.asinh(mark) <= top);
    const ticks = [...marks.map((mark) => -mark).reverse(), 0, ...marks];
    const colorbar = { tickvals: ticks.map(Math.asinh), ticktext: ticks.map((tick) => minus(String(tick))) };
    return { z, zmin: -top, zmax: top, unit: "standard errors", colorbar, ...colours };
  }

  drawMap(name) {
    const { plane } = this;
    const { z, zmin, zmax, colorscale, title, unit, colorbar } = this.shown(name);
    // A surface of a phase would have walls where it turns over.
    const surface = this.form.view.value === "surface" && name !== "phase";
    const bar = { thickness: 12, title: { text: plain(unit), side: "right" }, ...colorbar };
    const common = { x: plane.x_mm, y: plane.y_mm, z, colorscale, colorbar: bar };
    const trace = surface
      ? { ...common, type: "surface", cmin: zmin, cmax: zmax, hovertemplate: "%{x}, %{y} mm<extra></extra>" }
      : { ...common, type: "heatmap", zmin, zmax, hoverinfo: "none" };
    const [row, column] = this.place;
    const at = { x: [plane.x_mm[column]], y: [plane.y_mm[row]] };
    const mark = (more, symbol) =>
      ({ type: "scatter", mode: "markers", hoverinfo: "skip", marker: { symbol, size: 11, color: "white", line: { color: "black", width: 1.5 } }, ...more });
    const focus = plane.focus_mm ? [mark({ x: [plane.focus_mm[0]], y: [plane.focus_mm[1]] }, "x")] : [];
    const traces = surface ? [trace] : [trace, ...focus, mark(at, "circle-open")];
    const [x, y] = this.zoom ?? [undefined, undefined];
    const layout = surface
      ? this.layout(title, { scene: { xaxis: { title: { text: "x (mm)" } }, yaxis: { title: { text: "y (mm)" } }, zaxis: { title: { text: plain(unit) } } } })
      : this.layout(title, {
        xaxis: { title: { text: "x (mm)" }, range: x, constrain: "domain" },
        yaxis: { title: { text: "y (mm)" }, range: y, scaleanchor: "x", constrain: "domain" },
      });
    const div = document.getElementById(name);
    Plotly.react(div, traces, layout, CONFIGURATION);
    if (!div.dataset.listens) this.listen(div);
  }

  /** Zoom, cursor and clicks of a map. */
  listen(div) {
    div.dataset.listens = "yes";
    div.on("plotly_hover", ({ points: [point] }) => {
      if (Array.isArray(point.pointIndex)) this.tell(point.pointIndex);
    });
    div.on("plotly_click", ({ points: [point] }) => {
      if (!Array.isArray(point.pointIndex)) return;
      this.place = point.pointIndex;
      this.draw();
    });
    div.on("plotly_relayout", (change) => {
      if (this.drawing || this.form.view.value === "surface") return;
      const range = (axis) => [change[`${axis}axis.range[0]`], change[`${axis}axis.range[1]`]];
      const [x, y] = [range("x"), range("y")];
      if (change["xaxis.autorange"]) this.zoom = null;
      else if (x[0] !== undefined && y[0] !== undefined) this.zoom = [x, y];
      else return;
      this.draw();
    });
  }

  /** Says the values at a row and column. */
  tell([row, column]) {
    const { plane } = this;
    const at = (name) => rows(plane, name)[row][column];
    const simulation = at("simulation");
    let text = `(${plane.x_mm[column]}, ${plane.y_mm[row]}, ${plane.z_mm}) mm: `;
    if (this.isMeasured) {
      const difference = at("scan") - simulation;
      text += `scan ${digits(at("scan"))}, simulation ${digits(simulation)}, difference ${digits(difference)} `
        + `${this.readingUnit()} = ${digits(difference / this.error(simulation))} standard errors`;
    } else {
      const decibels = 20 * Math.log10(simulation / largest(rows(plane, "simulation")));
      text += `amplitude ${digits(simulation)} (${this.readingUnit()}), ${digits(decibels)} dB of the largest at this height`;
    }
    if (plane.level) {
      const { pa_per_unit, expanded_db } = plane.level;
      const pressure = (name) => `${name} ${digits(at(name) * pa_per_unit)} Pa rms = ${level(at(name) * pa_per_unit).toFixed(1)} dB`;
      text += `; ${pressure("scan")}, ${pressure("simulation")} re 20 µPa (at the peak of this height ± ${expanded_db.toFixed(1)} dB, k = 2)`;
    }
    if (plane.phase) text += `, phase of the simulation ${Math.round(at("phase"))}°`;
    document.getElementById("values").textContent = minus(text);
  }

  drawSection(name) {
    const { plane, planes } = this;
    const [row, column] = this.place;
    const [x, y] = [plane.x_mm[column], plane.y_mm[row]];
    const [along, title, axis, of] = {
      "along-x": [plane.x_mm, `y = ${y} mm`, "x (mm)", (map, shown) => Array.from(rows(plane, map)[row], (value) => shown(value, plane))],
      "along-y": [plane.y_mm, `x = ${x} mm`, "y (mm)", (map, shown) => rows(plane, map).map((values) => shown(values[column], plane))],
      "along-z": [planes.map((other) => other.z_mm), `(${x}, ${y}) mm`, "z (mm)", (map, shown) => planes.map((other) =>
        shown(rows(other, map)[nearest(other.y_mm, y)][nearest(other.x_mm, x)], other))],
    }[name];
    const shown = (value, of) => value * this.factor(of);
    const traces = [
      { x: along, y: of("simulation", shown), type: "scatter", mode: name === "along-z" ? "lines+markers" : "lines", name: "simulation", line: { color: "#d55e00", width: 2 } },
    ];
    if (this.isMeasured) {
      const array = of("scan", (value, plane) => this.error(value) * this.factor(plane));
      const errors = { type: "data", array, thickness: 1, width: 0 };
      traces.push({ x: along, y: of("scan", shown), type: "scatter", mode: "markers", name: "scan", error_y: errors, marker: { color: "#0072b2", size: 5 } });
    }
    const scale = this.isLogarithmic ? { type: "log" } : { rangemode: "tozero" };
    const layout = this.layout(minus(title), {
      xaxis: { title: { text: axis } },
      yaxis: { title: { text: plain(`${this.isMeasured && !this.isAbsolute ? "reading" : "pressure"} (${this.unit()})`) }, ...scale },
    });
    Plotly.react(document.getElementById(name), traces, layout, CONFIGURATION);
  }

  /** The heights that lie on the grid of this one, thinned in x and y so that a graphics card can follow. */
  stack() {
    const { plane, planes } = this;
    const alike = (a, b) => a.length === b.length && a[0] === b[0] && a.at(-1) === b.at(-1);
    const stack = planes.filter((one) => alike(one.x_mm, plane.x_mm) && alike(one.y_mm, plane.y_mm));
    const points = stack.length * plane.x_mm.length * plane.y_mm.length;
    const stride = Math.max(1, Math.ceil(Math.sqrt(points / MOST_POINTS_3D)));
    const thinned = (along) => along.map((_, index) => index).filter((index) => index % stride === 0);
    return { stack, columns: thinned(plane.x_mm), lines: thinned(plane.y_mm) };
  }

  /** Whether what is drawn in three dimensions has to wait for the whole script, which is loaded when it is first needed. */
  isWaiting() {
    if (this.whole === "no") this.loadWhole();
    return this.whole !== "yes";
  }

  async loadWhole() {
    this.whole = "loading";
    document.getElementById("values").textContent = "Unpacking…";
    await loadPlotly("plotly-3d");
    // Plots of one script cannot be changed by another.
    for (const div of document.querySelectorAll(".js-plotly-plot")) {
      div.replaceWith(Object.assign(document.createElement("div"), { id: div.id }));
    }
    this.whole = "yes";
    this.draw();
  }

  /** The view in three dimensions, drawn only where it is opened. */
  drawVolume() {
    const { stack, columns, lines } = this.stack();
    this.volume.hidden = stack.length < 2 || columns.length < 2 || lines.length < 2;
    if (this.volume.hidden || !this.volume.open || this.isWaiting()) return;
    const [x, y, z, value] = [[], [], [], []];
    for (const one of stack) {
      const map = rows(one, "simulation");
      for (const row of lines) {
        for (const column of columns) {
          x.push(one.x_mm[column]);
          y.push(one.y_mm[row]);
          z.push(one.z_mm);
          value.push(map[row][column] * this.factor(one));
        }
      }
    }
    const top = value.reduce((a, b) => Math.max(a, b), 0) || 1;
    const decibel = this.isLogarithmic;
    const levels = decibel ? value.map((level) => Math.max(LEAST_DECIBELS, 20 * Math.log10(level / top))) : value;
    const [isomin, isomax] = decibel ? [-12, -1] : [0.25 * top, 0.9 * top];
    const none = { x: { show: false }, y: { show: false }, z: { show: false } };
    const bar = { thickness: 12, title: { text: plain(decibel ? "dB" : this.unit()), side: "right" } };
    const trace = { type: "isosurface", x, y, z, value: levels, isomin, isomax, surface: { count: 4 }, opacity: 0.45, caps: none, colorscale: "Viridis", colorbar: bar };
    const axis = (name) => ({ title: { text: `${name} (mm)` } });
    const scene = { xaxis: axis("x"), yaxis: axis("y"), zaxis: axis("z"), aspectmode: "data" };
    Plotly.react(document.getElementById("volume"), [trace], this.layout(`simulation (${this.comparison.simulator}), surfaces of equal level`, { scene }), CONFIGURATION);
  }

  draw() {
    const { form, planes } = this;
    if (form.view.value === "surface" && this.isWaiting()) return;
    form.height.max = String(planes.length - 1);
    form.height.parentElement.hidden = planes.length < 2;
    const { plane } = this;
    form["height-mm"].value = minus(`${plane.z_mm} mm`);
    const [row, column] = this.place ?? peak(rows(plane, this.isMeasured ? "scan" : "simulation"));
    this.place = [Math.min(row, plane.y_mm.length - 1), Math.min(column, plane.x_mm.length - 1)];
    this.drawing = true;
    this.shownMaps.forEach((name) => this.drawMap(name));
    this.drawing = false;
    this.tell(this.place);
    // The maps are seen first; the rest follows.
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      SECTIONS.forEach((name) => this.drawSection(name));
      this.drawVolume();
      if (this.whole !== "loading") document.documentElement.dataset.complete = "yes";
    });
  }
}

(async () => {
  const began = performance.now();
  const passed = () => String(Math.round(performance.now() - began));
  const { dataset } = document.documentElement;
  try {
    await loadPlotly("plotly");
    dataset.loadedMs = passed();
    new Explorer(JSON.parse(document.getElementById("maps").textContent)).draw();
    dataset.drawnMs = passed();
    dataset.sinceOpenedMs = String(Math.round(performance.now()));
  } catch (error) {
    document.getElementById("values").textContent = `The maps cannot be drawn by this browser: ${error}`;
  }
})();
