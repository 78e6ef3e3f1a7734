"use strict";
// -- Background, as in voxdisplay/view/axes_and_grid.py: floor, box, axes

const resizeCanvas = (it, width, height) => {
  if (it.width !== width || it.height !== height) Object.assign(it, { width, height });
};
const tracePath = (context, ...points) => {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
};
const AXIS_COLORS = ["#ff5454", "#48d670", "#5c94ff"];
const stageCanvas = document.createElement("canvas"), pen = stageCanvas.getContext("2d", { alpha: false });
// A corner is three bits; along an edge, a coordinate grows.
const EDGES = [0, 1, 2].flatMap(axis => [...Array(8).keys()].filter(c => c >> axis & 1).map(c => [c ^ 1 << axis, c]));
const corner = (c, size) => size.map((n, k) => n * (c >> k & 1));
let stageKey = "";

// The edge on which an axis is drawn, of those in the box's outline the lowest, for z the leftmost:
// its corners, and the unit vector away from the box; none for an axis that points at the camera.
function outlineAxes(size, width, height, of = projection(size, width, height)) {
  const points = [...Array(8).keys()].map(c => project(corner(c, size), of)), found = [];
  for (const [a, b] of EDGES) {
    const axis = Math.log2(a ^ b), [x, y] = points[a], dx = points[b][0] - x, dy = points[b][1] - y;
    const length = Math.hypot(dx, dy);
    if (length < 0.05 * Math.min(width, height)) continue;
    const beyond = points.map(p => ((p[0] - x) * dy - (p[1] - y) * dx) / length);
    const side = Math.min(...beyond) > -0.01 ? 1 : Math.max(...beyond) < 0.01 ? -1 : 0;
    const rank = axis === 2 ? -x - dx / 2 : y + dy / 2;
    if (side && rank > (found[axis]?.rank ?? -Infinity) + 0.01)
      found[axis] = { axis, a, b, rank, middle: [x + dx / 2, y + dy / 2], out: [-side * dy / length, side * dx / length] };
  }
  return found.filter(Boolean);
}

function drawStage(size, width, height, pixel) {
  const key = JSON.stringify([size, width, height, pixel, camera, show, slices]);
  if (key === stageKey) return;
  stageKey = key;
  resizeCanvas(stageCanvas, width, height);
  pen.fillStyle = "#07090e";
  pen.fillRect(0, 0, width, height);
  if (!show.box || !size) return;
  const of = projection(size, width, height), unit = pixel * Math.max(1, Math.min(width, height) / pixel / 600);
  const middle = of.k / camera.distance / of.L, longest = Math.max(...size);
  const line = (from, to, color, thick, opacity = 1) => {
    pen.strokeStyle = color;
    pen.lineWidth = thick * unit;
    for (let i = 0, last = project(from, of); i < 6; i++) {
      const next = project(from.map((c, k) => c + (to[k] - c) * (i + 1) / 6), of);
      pen.globalAlpha = clamp((last[2] + next[2]) / 2 / middle * 1.55 - 0.95, 0.12, 1) * opacity;
      tracePath(pen, last, next);
      pen.stroke();
      last = next;
    }
    pen.globalAlpha = 1;
  };
  let step = 1;
  while (longest > 8 * step) step *= 2;
  for (let x = step; x < size[0]; x += step) line([x, 0, 0], [x, size[1], 0], "#3c465c", 0.9);
  for (let y = step; y < size[1]; y += step) line([0, y, 0], [size[0], y, 0], "#3c465c", 0.9);
  slices.forEach((ends, axis) => ends.forEach((at, end) => {
    if (at !== (end ? size[axis] - 1 : 0))
      for (const [a, b] of EDGES.filter(([a, b]) => !((a ^ b) >> axis & 1) && !(a >> axis & 1)))
        line(...[a, b].map(c => corner(c, size).map((v, k) => k === axis ? at + end : v)), AXIS_COLORS[axis], 1.2);
  }));
  const axes = outlineAxes(size, width, height, of), nearest = [0, 1, 2, 3, 4, 5, 6, 7]
    .reduce((best, c) => project(corner(c, size), of)[3] < project(corner(best, size), of)[3] ? c : best, 0);
  for (const before of [false, true])
    for (const [a, b] of EDGES)
      if ((a === nearest || b === nearest) === before && !axes.some(axis => axis.a === a && axis.b === b))
        line(corner(a, size), corner(b, size), "#5c6880", 1, before ? 0.35 : 1);
  const high = Math.max(10 * pixel, Math.min(width, height) / 40), thick = 1.5 * unit;
  pen.font = `${high}px system-ui, sans-serif`;
  pen.textBaseline = "middle";
  for (const { axis, a, b, middle: [mx, my], out: [ox, oy] } of axes) {
    const start = project(corner(a, size), of);
    const tip = project(corner(b, size).map((c, k) => k === axis ? c + 0.075 * longest : c), of);
    const [ax, ay] = [tip[0] - start[0], tip[1] - start[1]], length = Math.hypot(ax, ay), [ux, uy] = [ax / length, ay / length];
    pen.strokeStyle = pen.fillStyle = AXIS_COLORS[axis];
    pen.lineWidth = thick;
    const back = (along, side) => [tip[0] - thick * (along * ux + side * uy), tip[1] - thick * (along * uy - side * ux)];
    tracePath(pen, start, back(5, 0));
    pen.stroke();
    tracePath(pen, tip, back(5.5, 2.1), back(5.5, -2.1));
    pen.fill();
    const name = `${AXES[axis]} `, wide = pen.measureText(name + size[axis]).width;
    const away = (Math.abs(ox) * wide + Math.abs(oy) * high) / 2 + 0.7 * high;
    const left = mx + ox * away, top = my + oy * away;
    if (left < 0 || left > width || top < 0 || top > height) continue;
    const x = clamp(left - wide / 2, 2, width - wide - 2), y = clamp(top, high / 2, height - high / 2);
    pen.fillText(name, x, y);
    pen.fillStyle = "#96a0b4";
    pen.fillText(size[axis], x + pen.measureText(name).width, y);
  }
}
