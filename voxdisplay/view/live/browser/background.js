"use strict";
// -- Background, as in voxdisplay/view/stage.py: floor, box, axes

const resizeCanvas = (it, width, height) => {
  if (it.width !== width || it.height !== height) Object.assign(it, { width, height });
};
const tracePath = (context, ...points) => {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
};
const AXIS_COLORS = ["#ff5454", "#48d670", "#5c94ff"];
const stageCanvas = document.createElement("canvas"), pen = stageCanvas.getContext("2d", { alpha: false });
// A corner is three bits; an edge that starts at corner 0 is an axis.
const EDGES = [0, 1, 2].flatMap(axis => [...Array(8).keys()].filter(c => c >> axis & 1).map(c => [c ^ 1 << axis, c]));
const corner = (c, size) => size.map((n, k) => n * (c >> k & 1));
let stageKey = "";

function drawStage(size, width, height, pixel) {
  const key = JSON.stringify([size, width, height, pixel, camera, show.box]);
  if (key === stageKey) return;
  stageKey = key;
  resizeCanvas(stageCanvas, width, height);
  pen.fillStyle = "#07090e";
  pen.fillRect(0, 0, width, height);
  if (!show.box || !size) return;
  const of = projection(size, width, height), unit = pixel * Math.max(1, Math.min(width, height) / pixel / 600);
  const middle = of.k / camera.distance / of.L, longest = Math.max(...size);
  const line = (from, to, color, thick) => {
    pen.strokeStyle = color;
    pen.lineWidth = thick * unit;
    for (let i = 0, last = project(from, of); i < 6; i++) {
      const next = project(from.map((c, k) => c + (to[k] - c) * (i + 1) / 6), of);
      pen.globalAlpha = clamp((last[2] + next[2]) / 2 / middle * 1.55 - 0.95, 0.12, 1);
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
  for (const [a, b] of EDGES.filter(([a]) => a)) line(corner(a, size), corner(b, size), "#5c6880", 1);
  const origin = project([0, 0, 0], of), high = Math.max(10 * pixel, Math.min(width, height) / 40);
  pen.font = `${high}px system-ui, sans-serif`;
  pen.textBaseline = "middle";
  for (let axis = 0; axis < 3; axis++) {
    const tip = project(size.map((n, k) => k === axis ? n + 0.075 * longest : 0), of);
    const [ax, ay] = [tip[0] - origin[0], tip[1] - origin[1]], length = Math.hypot(ax, ay) || 1;
    const [ux, uy] = [ax / length, ay / length], thick = 1.7 * unit;
    pen.strokeStyle = pen.fillStyle = AXIS_COLORS[axis];
    pen.lineWidth = thick;
    const back = (along, side) => [tip[0] - thick * (along * ux + side * uy), tip[1] - thick * (along * uy - side * ux)];
    tracePath(pen, origin, back(5, 0));
    pen.stroke();
    tracePath(pen, tip, back(5.5, 2.1), back(5.5, -2.1));
    pen.fill();
    const name = `${AXES[axis]} `, wide = pen.measureText(name + size[axis]).width;
    const out = (Math.abs(ux) * wide + Math.abs(uy) * high) / 2 + high / 2;
    const x = clamp(tip[0] + ux * out - wide / 2, 2, width - wide - 2);
    const y = clamp(tip[1] + uy * out, high / 2, height - high / 2);
    pen.fillText(name, x, y);
    pen.fillStyle = "#96a0b4";
    pen.fillText(size[axis], x + pen.measureText(name).width, y);
  }
}
