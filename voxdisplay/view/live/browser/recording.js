"use strict";
// -- Recordings of voxels for `voxdisplay play`: recording.md, of frames drawn by PEN, SKIP and RUN

const VOXELS_FPS = 30, MOST_PAYLOAD = 1024, MOST_TAKEN = 256e6;
const CRC = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let bit = 0; bit < 8; bit++) n = n & 1 ? 0xEDB88320 ^ n >>> 1 : n >>> 1;
  return n;
});
const little = (value, size) => Array.from({ length: size }, (_, i) => Math.floor(value / 256 ** i) % 256);
// Return a packet with its check value, encoded by COBS and delimited.
function packetOf(type, flags, seq, frame, payload) {
  const body = [type << 4 | flags, seq % 256, frame % 256, ...payload];
  const crc = body.reduce((sum, byte) => CRC[(sum ^ byte) & 255] ^ sum >>> 8, -1);
  const out = [1];
  let code = 0;
  for (const byte of [...body, ...little(~crc >>> 0, 4)]) {
    if (out[code] === 255) code = out.push(1) - 1;
    if (byte) out.push(byte), out[code]++;
    else code = out.push(1) - 1;
  }
  return Uint8Array.from([...out, 0]);
}
function countOp(op, n) {
  if (n < 32) return [op | n - 1];
  const bytes = [op | 31];
  for (n -= 32; n > 127; n = Math.floor(n / 128)) bytes.push(n % 128 | 128);
  return [...bytes, n];
}
function payloadsOf({ n, size: [nx, ny], positions: [x, y, z], value, format, palette, own }) {
  const bytes = { mono1: 1, index8: 1, rgb565: 2, rgb888: 3 }[format], full = format === "mono1" ? 1 : 256 ** bytes - 1;
  const payloads = [];
  let ops = [], cursor = 0, pen = full;
  if (own.length) {
    const first = own[0], entries = own.at(-1) - first + 1;
    ops.push(6, first, entries - 1);
    for (let i = first; i < first + entries; i++) ops.push(palette[0][i], palette[1][i], palette[2][i]);
  }
  const index = i => x[i] + nx * (y[i] + ny * z[i]);
  for (let i = 0; i < n;) {
    const at = index(i), pixel = value(i);
    let end = i + 1;
    while (end < n && index(end) === at + end - i && value(end) === pixel) end++;
    if (ops.length > MOST_PAYLOAD - 20) {
      payloads.push(ops);
      ops = [], cursor = 0, pen = full;
    }
    if (pixel !== pen) ops.push(1, ...little(pen = pixel, bytes));
    if (at > cursor) ops.push(...countOp(0x80, at - cursor));
    ops.push(...countOp(0xA0, end - i));
    cursor = at + end - i;
    i = end;
  }
  return [...payloads, ops];
}
// Return a recording of taken messages and the times at which they came, in milliseconds, up to an end.
function recordingOf(taken, until, fps) {
  const frames = new Map(), refresh = Math.round(fps * 1000), parts = [Uint8Array.of(0)], sizes = [];
  const { size, format, title } = decode(taken[0][1]);
  const drawn = buffer => {
    if (!frames.has(buffer)) {
      const frame = decode(buffer), payloads = payloadsOf(frame);
      frames.set(buffer, { payloads, digest: parseInt(digest(frame), 16), own: frame.own.length });
    }
    return frames.get(buffer);
  };
  const shown = taken.filter(([, buffer]) => {
    const other = decode(buffer);
    return other.format === format && other.size.join() === size.join();
  });
  const count = Math.max(1, Math.round((until - shown[0][0]) * fps / 1000));
  const number = { mono1: 1, index8: 2, rgb565: 3, rgb888: 4 }[format];
  const features = shown.some(([, buffer]) => drawn(buffer).own) ? 1 << 6 : 0;
  let length = 1;
  const add = (...packet) => {
    const data = packetOf(...packet);
    parts.push(data);
    length += data.length;
    return data.length;
  };
  add(3, 0, 0, 0, [1, 1, 0, 0, 0]);
  add(9, 0, 0, 0, [1, 1, 0, 0, 0, 0, number, ...size.flatMap(side => little(side, 2)), 2, 0, ...little(MOST_PAYLOAD, 2),
    ...little(2 * MOST_PAYLOAD, 4), ...little(refresh, 4), ...little(features, 4), 0, 0, 0]);
  const meta = JSON.stringify({ version: 1, loop: false, name: title.slice(0, 99), software: "voxdisplay live view" });
  add(12, 0, 0, 0, new TextEncoder().encode(meta));
  const start = length;
  for (let n = 0, at = 0, seq = 0; n < count; n++) {
    while (at + 1 < shown.length && shown[at + 1][0] - shown[0][0] <= n * 1000 / fps + 1e-6) at++;
    const { payloads, digest: sum } = drawn(shown[at][1]);
    const bytes = payloads.reduce((all, ops) => all + ops.length, 0);
    let size = add(6, 1, 0, n, [...little(Math.floor(n * 1e7 / refresh + 0.5), 4), ...little(sum, 4), ...little(bytes, 4), 0]);
    payloads.forEach((ops, i) => size += add(1, i === payloads.length - 1 ? 5 : 1, seq++, n, ops));
    sizes.push(size);
  }
  const index = length;
  let offset = start;
  for (let first = 0; first < count; first += 250) {
    const some = sizes.slice(first, first + 250);
    add(7, 0, 0, 0, [...little(first, 4), ...little(offset, 8), ...some.flatMap(size => little(2 * size + 1, 4))]);
    offset += some.reduce((all, size) => all + size, 0);
  }
  add(7, 1, 0, 0, [...little(index, 8), ...little(count, 4), ...little(Math.floor(count * 1e7 / refresh + 0.5), 4)]);
  return new Blob(parts);
}
let taken = null, takenBytes = 0;
function take(buffer) {
  if (!taken) return;
  taken.push([performance.now(), buffer]);
  takenBytes += buffer.byteLength;
  if (takenBytes > MOST_TAKEN) recordVoxels();
}
function recordVoxels() {
  if (!history.length) return;
  if (embedded) {
    const film = history.map((buffer, i) => [i * 1000 / embedded.fps, buffer]);
    return download(recordingOf(film, history.length * 1000 / embedded.fps, embedded.fps), "voxdisplay.vxs");
  }
  const before = taken;
  taken = before ? null : [];
  $("voxels").ariaPressed = !before;
  setText("voxels", before ? "Record voxels" : "Stop");
  if (before) return download(recordingOf(before, performance.now(), VOXELS_FPS), "voxdisplay.vxs");
  takenBytes = 0;
  take(history.at(-1));
}
