"use strict";
// -- Camera: the projection of voxdisplay/view/camera.py, then panned and magnified

const slices = [[0, 65535], [0, 65535], [0, 65535]];
const START = { yaw: -0.6, pitch: 0.42, distance: 2.6, zoom: 1, x: 0, y: 0 };
const show = { glow: true, box: true, cubes: false, spin: false, flat: false, ghost: true };
const camera = { ...START };

// The projection as numbers: right, up and depth are linear in x, y and z.
function projection([nx, ny, nz], width, height) {
  const L = Math.max(nx, ny, nz), minSide = Math.min(width, height);
  const cy = Math.cos(camera.yaw), sy = Math.sin(camera.yaw), cp = Math.cos(camera.pitch), sp = Math.sin(camera.pitch);
  const line = (a, b, c, d = 0) => [a / L, b / L, c / L, d - (a * nx + b * ny + c * nz) / 2 / L];
  // Fitted is the cylinder that the box sweeps in a turn: see Camera.fitted.
  const D = camera.distance, f = show.flat ? 0 : 1, r = Math.hypot(nx, ny) / 2 / L, h = nz / 2 / L;
  const rims = [-h, h].flatMap(z => [-r, r].map(a => (z * cp + a * sp) / (D + f * (a * cp - z * sp))));
  const low = Math.min(...rims), high = Math.max(...rims), near = D - f * h * Math.abs(sp);
  const wide = 2 * r / Math.sqrt(near ** 2 - (f * r * cp) ** 2), margins = 0.2 * minSide;
  const k = camera.zoom * Math.min((width - margins) / wide, (height - margins) / (high - low));
  return {
    L, k, right: line(cy, -sy, 0), up: line(sy * sp, cy * sp, cp),
    depth: line(f * sy * cp, f * cy * cp, -f * sp, D),
    x: width / 2 + camera.x * minSide, y: height / 2 + camera.y * minSide + k * (low + high) / 2,
  };
}

function project([x, y, z], of) {
  const along = ([a, b, c, d]) => a * x + b * y + c * z + d;
  const depth = along(of.depth), k = of.k / depth;
  return [of.x + k * along(of.right), of.y - k * along(of.up), k / of.L, depth];
}

// Screen position and depth of each voxel: x, y, depth. Outside the slices, depths are negative.
// Light of voxels outside the slices: so little that many behind each other stay dim.
const ghostLight = n => show.ghost ? 0.02 * Math.min(1, 1e4 / n) : 0;

function projectAll({ n, positions: [X, Y, Z] }, of) {
  const { right: [r0, r1, r2, r3], up: [u0, u1, u2, u3], depth: [d0, d1, d2, d3], k, x: mx, y: my } = of;
  const [[x0, x1], [y0, y1], [z0, z1]] = slices, seen = new Float32Array(3 * n);
  for (let i = 0, o = 0; i < n; i++) {
    const xi = X[i], yi = Y[i], zi = Z[i], x = xi + 0.5, y = yi + 0.5, z = zi + 0.5;
    const depth = d0 * x + d1 * y + d2 * z + d3, scale = k / depth;
    seen[o++] = mx + scale * (r0 * x + r1 * y + r2 * z + r3);
    seen[o++] = my - scale * (u0 * x + u1 * y + u2 * z + u3);
    seen[o++] = xi < x0 || xi > x1 || yi < y0 || yi > y1 || zi < z0 || zi > z1 ? -depth : depth;
  }
  return seen;
}
