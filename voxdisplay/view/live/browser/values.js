"use strict";
// -- Colours by value, of index8 pictures and of those that are grey

const MAPS = {
  viridis: "440154 3b528b 21918c 5ec962 fde725", magma: "000004 51127c b73779 fc8961 fcfdbf",
  ice: "08102a 1c4e80 4fa3d1 b8e6f5 ffffff", rainbow: "3030ff 00c8ff 30e060 ffe020 ff3030",
};
$("map").append(...Object.keys(MAPS).map(name => make("option", { textContent: name })));
function channelsOf(name) {
  const stops = MAPS[name].split(" ").map(text => [0, 2, 4].map(i => parseInt(text.slice(i, i + 2), 16)));
  return [0, 1, 2].map(k => Uint8Array.from({ length: 256 }, (_, v) => {
    const at = v / 255 * (stops.length - 1), i = Math.min(at | 0, stops.length - 2);
    return Math.round(stops[i][k] + (stops[i + 1][k] - stops[i][k]) * (at - i));
  }));
}
const hasValues = ({ format, colors: [r, g, b] }) => format === "index8" || format !== "mono1" && r.every((v, i) => v === g[i] && v === b[i]);

// Return the picture as it is drawn: voxels from the threshold on, in the colours of the map.
function visible() {
  const frame = current();
  if (!frame) return null;
  frame.scalar ??= hasValues(frame);
  const map = $("map").value, from = +$("threshold").value;
  if (!frame.scalar || map === "own" && !from) return frame;
  if (frame.seen?.map === map && frame.seen.from === from) return frame.seen;
  const values = Uint8Array.from({ length: frame.n }, (_, i) => frame.format === "index8" ? frame.value(i) : frame.colors[0][i]);
  const kept = Uint32Array.from(values.keys()).filter(i => values[i] >= from), pick = plane => plane.constructor.from(kept, i => plane[i]);
  const colors = MAPS[map] ? channelsOf(map).map(channel => Uint8Array.from(kept, i => channel[values[i]])) : frame.colors.map(pick);
  return frame.seen = { ...frame, map, from, n: kept.length, colors, positions: frame.positions.map(pick), value: i => frame.value(kept[i]) };
}
