"use strict";
// -- The view in the address, behind #: what is nonsense there is not used

const toDegrees = radians => radians * 180 / Math.PI;
const NUMBERS = {  // lowest, highest, value, setter
  yaw: [-360, 360, () => toDegrees(camera.yaw % (2 * Math.PI)), v => camera.yaw = v / toDegrees(1)],
  pitch: [-90, 90, () => toDegrees(camera.pitch), v => camera.pitch = v / toDegrees(1)],
  zoom: [0.2, 12, () => camera.zoom, v => camera.zoom = v],
  x: [-6, 6, () => camera.x, v => camera.x = v],
  y: [-6, 6, () => camera.y, v => camera.y = v],
  exposure: [-4, 4, () => +$("exposure").value, v => $("exposure").value = v],
  from: [0, 255, () => +$("threshold").value, v => $("threshold").value = v],
};
function linkOfView() {
  const words = Object.entries(NUMBERS).map(([name, [, , get]]) => `${name}=${+get().toFixed(2)}`);
  words.push(`map=${$("map").value}`, `show=${Object.keys(show).filter(what => show[what])}`);
  slices.forEach(([from, to], axis) => (from || to < gridSize[axis] - 1) && words.push(`slice-${AXES[axis]}=${from}-${to}`));
  return `#${words.join("&")}`;
}
function followLink() {
  const given = new URLSearchParams(location.hash.slice(1));
  for (const [name, [low, high, , set]] of Object.entries(NUMBERS)) {
    const value = parseFloat(given.get(name));
    if (isFinite(value)) set(clamp(value, low, high));
  }
  if (given.has("show")) for (const what in show) setShow(what, given.get("show").split(",").includes(what));
  if (MAPS[given.get("map")]) $("map").value = given.get("map");
  for (const [axis, name] of [...AXES].entries()) {
    const ends = /^(\d{1,5})-(\d{1,5})$/.exec(given.get(`slice-${name}`));
    if (ends) setSlice(axis, Math.min(ends[1], ends[2]), Math.max(ends[1], ends[2]));
  }
  schedule();
}
addEventListener("hashchange", followLink);
let linked = null;
setInterval(() => {
  if (inCell || !gridSize[0] || show.spin) return;
  const now = linkOfView();
  if (linked && linked !== now) window.history.replaceState(null, "", now);
  linked = now;
}, 500);
