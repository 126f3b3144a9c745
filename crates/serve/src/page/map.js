// Drawings: maps of a height, the place of the robot, the trace of readings.

// Viridis (S. van der Walt and N. Smith, CC0), readable with any colour vision: nine points of it.
const VIRIDIS = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]];
// Blue to orange through white, for differences.
const DIVERGING = [[5, 48, 97], [67, 147, 195], [209, 229, 240], [247, 247, 247], [253, 219, 199], [230, 120, 60], [127, 39, 4]];

function colour(table, share) {
  const at = Math.min(Math.max(share, 0), 1) * (table.length - 1);
  const k = Math.min(Math.floor(at), table.length - 2), part = at - k;
  return `rgb(${table[k].map((a, c) => Math.round(a + (table[k + 1][c] - a) * part)).join()})`;
}

/** A canvas with a caption, drawn at the resolution of the screen. */
export function figure(parent, label) {
  const outer = document.createElement("figure");
  const canvas = document.createElement("canvas");
  const caption = document.createElement("figcaption");
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", label);
  outer.append(canvas, caption);
  parent.append(outer);
  return { canvas, caption };
}

export function prepared(canvas, ratio) {
  const width = canvas.clientWidth || 300, scale = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(width * ratio * scale);
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  return { context, width, height: width * ratio };
}

const ink = () => getComputedStyle(document.body).color;

/** The smallest distance of neighbouring values, as a grid has it. */
function step(values) {
  const sorted = [...new Set(values.map((value) => Math.round(value * 100) / 100))].sort((a, b) => a - b);
  let least = Infinity;
  for (let k = 1; k < sorted.length; k += 1) {
    const apart = sorted[k] - sorted[k - 1];
    if (apart > 0.04 && apart < least) least = apart;
  }
  return least;
}

/**
 * Draws the points of a height: [[x, y, value]], a range of values, the rectangle {x_mm, y_mm}.
 * Returns a function from a place on the canvas to mm.
 */
export function drawMap(canvas, points, [low, high], height, diverging) {
  let [x0, x1] = height.x_mm, [y0, y1] = height.y_mm;
  const dx = Math.min(step(points.map((p) => p[0])), (x1 - x0) || 1), dy = Math.min(step(points.map((p) => p[1])), (y1 - y0) || dx);
  x0 -= dx / 2; x1 += dx / 2; y0 -= dy / 2; y1 += dy / 2;
  const margin = 34;
  const ratio = Math.min(Math.max((y1 - y0) / (x1 - x0), 0.3), 1.4);
  const { context, width, height: tall } = prepared(canvas, ratio);
  const inner = width - margin - 6, innerTall = tall - margin - 6;
  const toX = (x) => margin + (x - x0) / (x1 - x0) * inner, toY = (y) => 6 + (y1 - y) / (y1 - y0) * innerTall;
  const w = dx / (x1 - x0) * inner, h = dy / (y1 - y0) * innerTall;
  for (const [x, y, value] of points) {
    context.fillStyle = colour(diverging ? DIVERGING : VIRIDIS, (value - low) / (high - low || 1));
    context.fillRect(toX(x) - w / 2, toY(y) - h / 2, w + 0.6, h + 0.6);
  }
  context.strokeStyle = context.fillStyle = ink();
  context.strokeRect(margin, 6, inner, innerTall);
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "center";
  for (const x of [height.x_mm[0], (height.x_mm[0] + height.x_mm[1]) / 2, height.x_mm[1]]) context.fillText(x.toFixed(1), toX(x), tall - margin + 14);
  context.fillText("x (mm)", margin + inner / 2, tall - 6);
  context.textAlign = "right";
  for (const y of [height.y_mm[0], (height.y_mm[0] + height.y_mm[1]) / 2, height.y_mm[1]]) context.fillText(y.toFixed(1), margin - 3, toY(y) + 4);
  context.save();
  context.translate(11, 6 + innerTall / 4);
  context.rotate(-Math.PI / 2);
  context.textAlign = "center";
  context.fillText("y (mm)", 0, 0);
  context.restore();
  return (px, py) => [x0 + (px - margin) / inner * (x1 - x0), y1 - (py - 6) / innerTall * (y1 - y0)];
}

/** Draws travel, keep-out boxes, array and robot from above and from the side. Returns a function from a place in the view from above to mm. */
export function drawPlace(canvas, rig, at, target) {
  const [tx, ty, tz] = rig.travel_mm;
  const wide = tx[1] - tx[0], deep = ty[1] - ty[0];
  const side = Math.min(tz[0], 0), tall = Math.max(tz[1], 0) - side;
  const { context, width, height } = prepared(canvas, (deep + tall + 50) / (wide + 30));
  const scale = Math.min(width / (wide + 30), height / (deep + tall + 50));
  const x = (mm) => (mm - tx[0] + 15) * scale, y = (mm) => (ty[1] - mm + 15) * scale, z = (mm) => (deep + 35 + tall - (mm - side)) * scale;
  context.strokeStyle = context.fillStyle = ink();
  context.font = "11px system-ui, sans-serif";
  context.fillText("from above (x, y)", x(tx[0]), y(ty[1]) - 3);
  context.fillText("from the side (x, z)", x(tx[0]), z(tz[1]) - 3);
  context.strokeRect(x(tx[0]), y(ty[1]), wide * scale, deep * scale);
  context.strokeRect(x(tx[0]), z(tz[1]), wide * scale, (tz[1] - tz[0]) * scale);
  context.globalAlpha = 0.35;
  for (const { mm: [bx, by, bz] } of rig.keep_out) {
    context.fillRect(x(bx[0]), y(by[1]), (bx[1] - bx[0]) * scale, (by[1] - by[0]) * scale);
    context.fillRect(x(bx[0]), z(bz[1]), (bx[1] - bx[0]) * scale, (bz[1] - bz[0]) * scale);
  }
  context.globalAlpha = 1;
  for (const [ex, ey, ez] of rig.elements_mm) {
    context.beginPath(); context.arc(x(ex), y(ey), 2, 0, 7); context.stroke();
    context.beginPath(); context.arc(x(ex), z(ez), 2, 0, 7); context.stroke();
  }
  const mark = ([mx, my, mz], fill) => {
    context.fillStyle = fill;
    for (const [px, py] of [[x(mx), y(my)], [x(mx), z(mz)]]) { context.beginPath(); context.arc(px, py, 6, 0, 7); context.fill(); }
  };
  if (at && target) {
    context.setLineDash([4, 4]);
    context.beginPath(); context.moveTo(x(at[0]), y(at[1])); context.lineTo(x(target[0]), y(target[1])); context.stroke();
    context.beginPath(); context.moveTo(x(at[0]), z(at[2])); context.lineTo(x(target[0]), z(target[2])); context.stroke();
    context.setLineDash([]);
    mark(target, "#8250df");
  }
  if (at) mark(at, "#d1242f");
  return (px, py) => {
    const place = [px / scale - 15 + tx[0], ty[1] + 15 - py / scale];
    return place[0] >= tx[0] && place[0] <= tx[1] && place[1] >= ty[0] && place[1] <= ty[1] ? place : null;
  };
}

/** Draws a curve against time, [[t, value]], upwards from zero or from its least value. */
export function drawTrace(canvas, points, fromZero) {
  const { context, width, height } = prepared(canvas, 0.3);
  if (points.length < 2) return;
  const times = points.map((p) => p[0]), values = points.map((p) => p[1]);
  const least = fromZero ? 0 : Math.min(...values), most = Math.max(...values, least + 1e-9);
  const t0 = times[0], t1 = times[times.length - 1] || 1;
  context.strokeStyle = ink();
  context.strokeRect(0.5, 0.5, width - 1, height - 1);
  context.strokeStyle = getComputedStyle(document.documentElement).getPropertyValue("--act");
  context.beginPath();
  points.forEach(([t, value], k) => {
    const px = (t - t0) / (t1 - t0 || 1) * (width - 8) + 4, py = height - 4 - (value - least) / (most - least) * (height - 8);
    if (k === 0) context.moveTo(px, py); else context.lineTo(px, py);
  });
  context.stroke();
}
