"use strict";

// Draws the maps of a report. Everything is in the page: the data, and the script of Plotly.

const SHOWN = ["scan", "simulation", "difference"];
const SECTIONS = ["along-x", "along-y", "along-z"];
const LEAST_DECIBELS = -50;
const CONFIGURATION = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };

const bytes = (base64) => Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));

/** Unpacks the script of Plotly and runs it. */
async function loadPlotly() {
  const packed = bytes(document.getElementById("plotly").textContent);
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(unpacked).text();
  document.head.append(script);
}

/** The data, with each map as an array of rows. */
function readMaps() {
  const maps = JSON.parse(document.getElementById("maps").textContent);
  for (const comparison of maps.comparisons) {
    for (const plane of comparison.planes) {
      for (const name of ["scan", "simulation"]) {
        const values = new Float32Array(bytes(plane[name]).buffer);
        const columns = plane.x_mm.length;
        plane[name] = plane.y_mm.map((_, row) =>
          Array.from(values.subarray(row * columns, (row + 1) * columns)));
      }
    }
  }
  return maps;
}

const largest = (rows) => rows.flat().filter(Number.isFinite).reduce((a, b) => Math.max(a, b), 0);

/** Index of the entry nearest to a place. */
const nearest = (along, at) =>
  along.reduce((best, place, index) =>
    (Math.abs(place - at) < Math.abs(along[best] - at) ? index : best), 0);

/** Row and column of the largest entry. */
function peak(rows) {
  const top = largest(rows);
  const row = Math.max(0, rows.findIndex((values) => values.includes(top)));
  return [row, Math.max(0, rows[row].indexOf(top))];
}

/** Text that Plotly shows as it is: it takes some markup in titles. */
const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");

const digits = (value) => (Number.isFinite(value) ? Number(value.toPrecision(4)).toString() : "–");

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

  unit() {
    return this.maps.unit || "the receiver's unit";
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

  /** Values, colour scale and title of one of the three maps. */
  shown(name) {
    const { plane, planes, form } = this;
    if (name === "difference") return this.difference();
    const of = form.range.value === "all" ? planes : [plane];
    const top = Math.max(...of.map(({ scan, simulation }) => Math.max(largest(scan), largest(simulation))));
    const title = name === "scan" ? "scan" : `simulation (${this.comparison.simulator})`;
    if (form.scale.value === "linear") {
      return { z: plane[name], zmin: 0, zmax: top, colorscale: "Viridis", title, unit: this.maps.unit };
    }
    const decibels = (value) => Math.max(LEAST_DECIBELS, 20 * Math.log10(Math.max(value, 1e-300) / top));
    const z = plane[name].map((row) => row.map(decibels));
    return { z, zmin: LEAST_DECIBELS, zmax: 0, colorscale: "Viridis", title, unit: "dB" };
  }

  /** The difference: in the unit, or in standard errors on a scale that never saturates. */
  difference() {
    const { scan, simulation } = this.plane;
    const differ = scan.map((row, r) => row.map((value, c) => value - simulation[r][c]));
    const colours = { colorscale: "RdBu", title: "scan − simulation" };
    if (this.form.difference.value === "unit") {
      const top = largest(differ.map((row) => row.map(Math.abs))) || 1;
      return { z: differ, zmin: -top, zmax: top, unit: this.maps.unit, ...colours };
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
    const surface = this.form.view.value === "surface";
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
    const [scan, simulation] = [plane.scan[row][column], plane.simulation[row][column]];
    const difference = scan - simulation;
    const errors = difference / this.error(simulation);
    const text = `(${plane.x_mm[column]}, ${plane.y_mm[row]}, ${plane.z_mm}) mm: scan ${digits(scan)}, `
      + `simulation ${digits(simulation)}, difference ${digits(difference)} ${this.unit()} = `
      + `${digits(errors)} standard errors`;
    document.getElementById("values").textContent = minus(text);
  }

  drawSection(name) {
    const { plane, planes } = this;
    const [row, column] = this.place;
    const [x, y] = [plane.x_mm[column], plane.y_mm[row]];
    const column_of = (values) => values.map((along) => along[column]);
    const over = (values) => planes.map((other) => {
      const at = other[values][nearest(other.y_mm, y)];
      return at[nearest(other.x_mm, x)];
    });
    const [along, scan, simulation, title, axis] = {
      "along-x": [plane.x_mm, plane.scan[row], plane.simulation[row], `y = ${y} mm`, "x (mm)"],
      "along-y": [plane.y_mm, column_of(plane.scan), column_of(plane.simulation), `x = ${x} mm`, "y (mm)"],
      "along-z": [planes.map((other) => other.z_mm), over("scan"), over("simulation"), `(${x}, ${y}) mm`, "z (mm)"],
    }[name];
    const errors = { type: "data", array: scan.map((level) => this.error(level)), thickness: 1, width: 0 };
    const traces = [
      { x: along, y: simulation, type: "scatter", mode: name === "along-z" ? "lines+markers" : "lines", name: "simulation", line: { color: "#d55e00", width: 2 } },
      { x: along, y: scan, type: "scatter", mode: "markers", name: "scan", error_y: errors, marker: { color: "#0072b2", size: 5 } },
    ];
    const scale = this.form.scale.value === "linear" ? { rangemode: "tozero" } : { type: "log" };
    const layout = this.layout(minus(title), {
      xaxis: { title: { text: axis } },
      yaxis: { title: { text: plain(`reading (${this.unit()})`) }, ...scale },
    });
    Plotly.react(document.getElementById(name), traces, layout, CONFIGURATION);
  }

  draw() {
    const { form, planes } = this;
    form.height.max = String(planes.length - 1);
    form.height.parentElement.hidden = planes.length < 2;
    const { plane } = this;
    form["height-mm"].value = minus(`${plane.z_mm} mm`);
    const [row, column] = this.place ?? peak(plane.scan);
    this.place = [Math.min(row, plane.y_mm.length - 1), Math.min(column, plane.x_mm.length - 1)];
    this.drawing = true;
    SHOWN.forEach((name) => this.drawMap(name));
    SECTIONS.forEach((name) => this.drawSection(name));
    this.drawing = false;
    this.tell(this.place);
  }
}

(async () => {
  const began = performance.now();
  try {
    await loadPlotly();
    new Explorer(readMaps()).draw();
    document.documentElement.dataset.drawnMs = String(Math.round(performance.now() - began));
  } catch (error) {
    document.getElementById("values").textContent = `The maps cannot be drawn by this browser: ${error}`;
  }
})();
