"use strict";
// -- Cubes: opaque voxels, the same whichever renderer draws the glow

const MOST_CUBES = 4e5;
// Corners of a cube's sides, by axis and end, in the order of their outline.
const SIDES = [[[0, 2, 6, 4], [1, 3, 7, 5]], [[0, 1, 5, 4], [2, 3, 7, 6]], [[0, 1, 3, 2], [4, 5, 7, 6]]];
const SHADES = [0.8, 0.62, 1];

function drawCubes(context, { n, size, positions, colors }, width, height) {
  const { right, up, depth, k, x: mx, y: my, L } = projection(size, width, height);
  const far = camera.distance * L * (show.flat ? 1e4 : 1), cp = Math.cos(camera.pitch);
  const eye = [-Math.sin(camera.yaw) * cp, -Math.cos(camera.yaw) * cp, Math.sin(camera.pitch)].map((c, a) => size[a] / 2 + c * far);
  const [nx, ny] = size, steps = [1, nx, nx * ny], lit = new Set(), away = new Float64Array(n), order = [];
  for (let i = 0; i < n; i++) {
    if (positions.some((plane, a) => plane[i] < slices[a][0] || plane[i] > slices[a][1])) continue;
    lit.add(positions[0][i] + nx * (positions[1][i] + ny * positions[2][i]));
    away[i] = positions.reduce((sum, plane, a) => sum + Math.abs(plane[i] + 0.5 - eye[a]), 0);
    order.push(i);
  }
  // What hides a cube is nearer to the eye along each axis, and so in their sum.
  order.sort((i, j) => away[j] - away[i]);
  const X = new Float64Array(8), Y = new Float64Array(8);
  for (const i of order) {
    const at = positions.map(plane => plane[i]), index = at[0] + nx * (at[1] + ny * at[2]), along = v => v[0] * at[0] + v[1] * at[1] + v[2] * at[2] + v[3];
    const r = along(right), u = along(up), d = along(depth), edge = (v, c) => v[0] * (c & 1) + v[1] * (c >> 1 & 1) + v[2] * (c >> 2);
    for (let c = 0; c < 8; c++) {
      const scale = k / (d + edge(depth, c));
      X[c] = mx + scale * (r + edge(right, c));
      Y[c] = my - scale * (u + edge(up, c));
    }
    for (let a = 0; a < 3; a++) {
      const end = eye[a] > at[a] + 1 ? 1 : eye[a] < at[a] ? 0 : -1, next = at[a] + 2 * end - 1;
      if (end < 0 || next >= 0 && next < size[a] && lit.has(index + (2 * end - 1) * steps[a])) continue;
      context.fillStyle = `rgb(${colors.map(channel => channel[i] * SHADES[a] | 0)})`;
      tracePath(context, ...SIDES[a][end].map(c => [X[c], Y[c]]));
      context.fill();
    }
  }
}
