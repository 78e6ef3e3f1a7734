"use strict";
// -- Input: pointer, keys, buttons

function rotate(yaw, pitch) {
  camera.yaw += yaw;
  camera.pitch = clamp(camera.pitch + pitch, -Math.PI / 2, Math.PI / 2);
  schedule();
}
function zoom(factor) {
  camera.zoom = clamp(camera.zoom * factor, 0.2, 12);
  schedule();
}
function pan(x, y) {
  camera.x = clamp(camera.x + x, -6, 6);
  camera.y = clamp(camera.y + y, -6, 6);
  schedule();
}
// Begin where the first picture is best seen from.
function beginView(view) {
  if (view) [START.yaw, START.pitch, START.zoom] = view;
  setCamera();
}
function setShow(what, on) {
  $(what).ariaPressed = show[what] = on;
  schedule();
}
const setCamera = changes => { Object.assign(camera, START, changes); schedule(); };

const area = $("stage"), touches = new Map();
let pointer = null;
const minSide = () => Math.min(area.clientWidth, area.clientHeight) || 1;
const listen = (kind, act, how) => area.addEventListener(kind, act, how);
// Pointer position, for the probe; none while dragging.
function setPointer(place) {
  const rim = area.getBoundingClientRect();
  pointer = place && [place.clientX - rim.left, place.clientY - rim.top];
  if (!pointer) hideProbe();
  schedule();
}
listen("pointerdown", event => {
  area.setPointerCapture(event.pointerId);
  setShow("spin", false);
  touches.set(event.pointerId, [event.clientX, event.clientY]);
  setPointer(event);
});
listen("lostpointercapture", event => touches.delete(event.pointerId));
listen("pointermove", event => {
  const before = touches.get(event.pointerId), now = [event.clientX, event.clientY];
  if (!before) return setPointer(event);
  const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
  if (!dx && !dy) return;
  setPointer(null);
  const other = [...touches].find(([id]) => id !== event.pointerId)?.[1];
  if (other) {
    const apart = p => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
    zoom(apart(now) / apart(before));
    pan(dx / 2 / minSide(), dy / 2 / minSide());
  } else if (event.shiftKey || event.buttons & 6) pan(dx / minSide(), dy / minSide());
  else rotate(dx * 0.008, dy * 0.008);
  touches.set(event.pointerId, now);
});
listen("pointerleave", () => setPointer(null));
listen("contextmenu", event => event.preventDefault());
listen("dblclick", () => setCamera());
listen("wheel", event => {
  if (inCell && !document.hasFocus()) return;  // it scrolls the notebook
  event.preventDefault();
  zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
}, { passive: false });

const hideProbe = () => { $("probe").hidden = true; return probed = null; };

// Find the nearest lit voxel under a position of the stage.
function probe(left, top) {
  const frame = visible();
  if (!frame) return null;
  const of = projection(frame.size, area.clientWidth, area.clientHeight), seen = projectAll(frame, of);
  let found = -1, best = Infinity;
  for (let i = 0, o = 0; i < frame.n; i++) {
    const x = seen[o++], y = seen[o++], depth = seen[o++], reach = Math.max(3, of.k / depth / of.L * 0.6);
    if (depth > 0 && depth < best && Math.abs(x - left) <= reach && Math.abs(y - top) <= reach) { found = i; best = depth; }
  }
  const tip = $("probe");
  if (found < 0) return hideProbe();
  tip.hidden = false;
  const color = "#" + frame.colors.map(c => c[found].toString(16).padStart(2, "0")).join("");
  const voxel = frame.positions.map(p => p[found]), named = voxel.map((v, k) => `${AXES[k]} ${v}`).join("  ");
  probed = { voxel, text: `${named}   ${frame.format === "rgb888" ? "" : `${frame.value(found)}   `}${color}` };
  tip.textContent = probed.text;
  const x = clamp(left + 14, 0, area.clientWidth - tip.offsetWidth), y = clamp(top + 16, 0, area.clientHeight - tip.offsetHeight);
  tip.style.transform = `translate(${x}px, ${y}px)`;
  return probed;
}

for (const [axis, name] of [...AXES].entries()) {
  const ends = ["from", "to"].map((what, end) => make("input", {
    type: "range", id: name + end, ariaLabel: `${name} ${what}`, disabled: true, oninput: ({ target: { valueAsNumber: to } }) =>
      end ? setSlice(axis, Math.min(slices[axis][0], to), to) : setSlice(axis, to, Math.max(slices[axis][1], to)),
  }));
  $("slices").append(make("div", { className: `slice ${name}`, role: "group", ariaLabel: `Slice along ${name}` },
    make("b", { textContent: name }), make("div", { className: "span" }, ...ends), make("output")));
}
let activeSlice = 2, gridSize = [0, 0, 0];
function setSlice(axis, low = 0, high = Infinity) {
  const top = gridSize[axis] - 1;
  slices[axis] = [clamp(low, 0, top), clamp(high, 0, top)];
  for (const end of [0, 1]) $(AXES[axis] + end).value = slices[axis][end];
  const [from, to] = slices[axis], { style } = $(AXES[axis] + 0).parentNode;
  style.setProperty("--before", `${100 * from / (top || 1)}%`);
  style.setProperty("--after", `${100 - 100 * to / (top || 1)}%`);
  document.querySelector(`.${AXES[axis]} output`).textContent = !from && to === top ? "all" : from === to ? `${from}` : `${from}–${to}`;
  activeSlice = axis;
  schedule();
}
function setGridSize(size) {
  if (size.join() === gridSize.join()) return;
  gridSize = size;
  for (let axis = 0; axis < 3; axis++) {
    for (const end of [0, 1]) Object.assign($(AXES[axis] + end), { max: gridSize[axis] - 1, disabled: false });
    setSlice(axis);
  }
  followLink();
}
const announceSlice = () => announce(`${AXES[activeSlice]} ${slices[activeSlice].join(" to ")}`);
function toggleLayer(axis) {
  const [from, to] = slices[axis], middle = gridSize[axis] >> 1;
  setSlice(axis, ...(from === to ? [] : [middle, middle]));
  announceSlice();
}
function moveSlice(by) {
  const [from, to] = slices[activeSlice], d = clamp(by, -from, gridSize[activeSlice] - 1 - to);
  setSlice(activeSlice, from + d, to + d);
  announceSlice();
}
const toggle = what => () => setShow(what, !show[what]);
const fullScreen = () => document.fullscreenElement ? document.exitFullscreen() : area.requestFullscreen();

// Commands: key, description, action, and for a button its group, id, and label or icon.
const step = by => history.length && setPlaying(false, cursor + by);
const newest = () => embedded ? step(Infinity) : setPlaying(true);
const arrow = (x, y) => event => event.shiftKey ? pan(x / 25, y / 25) : rotate(x / 10, -y / 10);
const PAUSE = "M6 5h4v14H6zM14 5h4v14h-4z";
const COMMANDS = [
  ["ArrowLeft", "rotate; with Shift: pan", arrow(-1, 0)],
  ["ArrowRight", "", arrow(1, 0)],
  ["ArrowUp", "", arrow(0, -1)],
  ["ArrowDown", "", arrow(0, 1)],
  ["+", "zoom in", () => zoom(1.15)],
  ["=", "", () => zoom(1.15)],
  ["-", "zoom out", () => zoom(1 / 1.15)],
  ["Home", "oldest frame kept", () => step(-Infinity), "playback", "first", "M6 5h2.5v14H6zM19 5v14l-9-7z"],
  [",", "previous frame", () => step(-1), "playback", "previous", "M16 5v14l-9-7z"],
  [" ", "pause, resume", () => setPlaying(!playing), "playback", "play", PAUSE],
  [".", "next frame", () => step(1), "playback", "next", "M8 5v14l9-7z"],
  ["End", "newest frame", newest, "playback", "last", "M15.5 5H18v14h-2.5zM5 5v14l9-7z"],
  ["g", "glow", toggle("glow"), "view", "glow", "Glow"],
  ["c", "voxels as cubes", toggle("cubes"), "view", "cubes", "Cubes"],
  ["b", "box and axes", toggle("box"), "view", "box", "Box"],
  ["a", "turn by itself", toggle("spin"), "view", "spin", "Spin"],
  ["o", "orthographic: parallels stay parallel", toggle("flat"), "view", "flat", "Flat"],
  ["h", "what slices cut away, as a ghost", toggle("ghost"), "view", "ghost", "Ghost"],
  ["f", "full screen", fullScreen, "view", "full", "Full screen"],
  ["0", "reset camera and slices", () => { setCamera(); [0, 1, 2].forEach(axis => setSlice(axis)); }, "view", "reset", "Reset"],
  ["1", "view from the front", () => setCamera({ yaw: 0, pitch: 0 }), "view", "front", "Front"],
  ["2", "view from the side", () => setCamera({ yaw: Math.PI / 2, pitch: 0 }), "view", "side", "Side"],
  ["3", "view from above", () => setCamera({ yaw: 0, pitch: Math.PI / 2 }), "view", "top", "Top"],
  ...[...AXES].map((name, axis) => [name, `one layer along ${name}, or all`, () => toggleLayer(axis)]),
  ["[", "move the slice down", () => moveSlice(-1)],
  ["]", "move the slice up", () => moveSlice(1)],
  ["v", "announce the voxel in the centre", () => {
    const found = probe(area.clientWidth / 2, area.clientHeight / 2);
    announce(found ? found.text : "no lit voxel in the centre");
    schedule();
  }],
  ["s", "save as PNG", savePng, "saving", "png", "Save PNG"],
  ["r", "record a video", record, "saving", "record", "Record"],
  ["t", "record voxels, as a file for voxdisplay play", recordVoxels, "saving", "voxels", "Record voxels"],
  ["?", "all keys", () => $("help").open ? $("help").close() : $("help").showModal(), "saving", "all", "Keys"],
];
const KEYS = {};
for (const [key, text, act, place, id, face] of COMMANDS) {
  KEYS[key] = act;
  const name = { ArrowLeft: "arrows", " ": "space" }[key] ?? key;
  if (text) $("keys").append(make("dt", { textContent: name }), make("dd", { textContent: text }));
  if (!place) continue;
  const button = make("button", { id, title: `${text} (${name})`, onclick: act, textContent: face });
  if (place === "playback") {
    button.className = "icon";
    button.ariaLabel = text;
    button.innerHTML = `<svg viewBox="0 0 24 24"><path d="${face}"/></svg>`;
  }
  $(place).append(button);
}
for (const what in show) $(what).ariaPressed = show[what];
$("help").onclick = () => $("help").close();
for (const id of ["exposure", "map", "threshold"]) $(id).oninput = schedule;
addEventListener("keydown", event => {
  const act = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  // Keys act only while no control has the focus.
  if (!act || event.ctrlKey || event.metaKey || event.altKey || ![area, document.body].includes(document.activeElement)) return;
  event.preventDefault();
  act(event);
});
$("scrub").oninput = event => setPlaying(false, event.target.valueAsNumber);
