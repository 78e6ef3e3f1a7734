"use strict";
const $ = id => document.getElementById(id);
const clamp = (v, low, high) => Math.min(Math.max(v, low), high);
const AXES = "xyz";
const make = (tag, given, ...inside) => {
  const it = Object.assign(document.createElement(tag), given);
  it.append(...inside);
  return it;
};

// -- Messages: see voxdisplay/view/live/snapshot_message.py

function headOf(buffer) {
  const start = new DataView(buffer).getUint32(0, true);
  return { start, ...JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, start - 4))) };
}
function decode(buffer) {
  const { start, ...head } = headOf(buffer);
  const { size: [nx, ny, nz], voxels: n, format } = head;
  const frame = { ...head, n };
  let at = start;
  const plane = (Kind, count) => {
    const view = new Kind(buffer, at, count);
    at += view.byteLength;
    return view;
  };
  if (head.bitmap) {
    const bits = plane(Uint8Array, Math.ceil(nx * ny * nz / 8));
    const [x, y, z] = frame.positions = [0, 0, 0].map(() => new Uint16Array(n));
    for (let byte = 0, i = 0; byte < bits.length; byte++)
      for (let left = bits[byte]; left; left &= left - 1) {
        const index = byte * 8 + 31 - Math.clz32(left & -left), row = Math.floor(index / nx);
        x[i] = index - row * nx; y[i] = row % ny; z[i++] = Math.floor(row / ny);
      }
  } else frame.positions = [0, 0, 0].map(() => plane(head.wide ? Uint16Array : Uint8Array, n));
  const bytes = (count, length) => Array.from({ length }, () => plane(Uint8Array, count));
  const pixels = bytes(n, { mono1: 0, index8: 1, rgb565: 2, rgb888: 3 }[format]);
  if (format === "index8") frame.palette = bytes(256, 3);
  const [p, q, r] = pixels;
  frame.value = { mono1: () => 1, index8: i => p[i], rgb565: i => p[i] | q[i] << 8, rgb888: i => p[i] | q[i] << 8 | r[i] << 16 }[format];
  const full = (level, top) => Math.floor((level * 510 + top) / (2 * top));
  const channels = {
    mono1: [() => 255, () => 255, () => 255],
    index8: frame.palette?.map(shown => v => shown[v]),
    rgb565: [v => full(v >> 11, 31), v => full(v >> 5 & 63, 63), v => full(v & 31, 31)],
  }[format];
  frame.colors = channels?.map(of => Uint8Array.from({ length: n }, (_, i) => of(frame.value(i)))) ?? pixels;
  return frame;
}

// The digest of protocol.md, section 8, over the very voxels and colours that are drawn.
function digest({ n, size: [nx, ny, nz], positions: [x, y, z], value, palette, own }) {
  let sum = 0;
  const add = (place, pixel) => {
    let h = Math.imul(place, 0x9E3779B1) + Math.imul(pixel, 0x85EBCA77);
    h ^= h >>> 15; h = Math.imul(h, 0x2C1B3C6D);
    h ^= h >>> 12; h = Math.imul(h, 0x297A2D39);
    sum = sum + (h ^ h >>> 15) | 0;
  };
  for (let i = 0; i < n; i++) add(x[i] + nx * (y[i] + ny * z[i]), value(i));
  for (const i of own) add(nx * ny * nz + i, 1 << 24 | palette[0][i] | palette[1][i] << 8 | palette[2][i] << 16);
  return (sum >>> 0).toString(16).padStart(8, "0");
}
