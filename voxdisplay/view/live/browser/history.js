"use strict";
// -- History: the last frames, and which of them is shown

const MOST_FRAMES = 900, MOST_BYTES = 128e6;
const history = [];
let cursor = -1, playing = true, keptBytes = 0, embedded = null, arrivals = [];

// Frames are kept as messages; only the one that is shown is decoded.
let shown = { buffer: null, frame: null };
function current() {
  const buffer = history[cursor];
  if (buffer && shown.buffer !== buffer) shown = { buffer, frame: decode(buffer) };
  return buffer ? shown.frame : null;
}

function push(buffer) {
  if (!history.length) beginView(decode(buffer).view);
  history.push(buffer);
  keptBytes += buffer.byteLength;
  while (!embedded && history.length > 1 && (history.length > MOST_FRAMES || keptBytes > MOST_BYTES)) {
    keptBytes -= history.shift().byteLength;
    cursor = Math.max(0, cursor - 1);
  }
  if (cursor < 0 || playing && !embedded) cursor = history.length - 1;
  arrivals.push(performance.now());
  take(buffer);
  schedule();
}

function seek(to) {
  cursor = clamp(to, 0, history.length - 1);
  schedule();
  updateStatus();
}

function setPlaying(on, to = cursor) {
  playing = on;
  $("play").ariaLabel = on ? "Pause" : "Resume";
  $("play").firstChild.firstChild.setAttribute("d", on ? PAUSE : "M8 5v14l11-7z");
  seek(on && !embedded ? Infinity : to);
}

function setText(id, text) {
  if ($(id).textContent !== text) $(id).textContent = text;
}
function setState(is) {
  if ($("state").dataset.is !== is) announce($("state").textContent = $("state").dataset.is = is);
}
const announce = text => setText("announcement", text);

// Update the texts about the frame that is shown; called at intervals that can be read.
function updateStatus() {
  const frame = current(), last = history.length - 1;
  $("scrub").max = Math.max(0, last);
  $("scrub").value = cursor;
  $("first").disabled = $("previous").disabled = cursor <= 0;
  $("next").disabled = cursor >= last;
  if (!frame) return;
  setText("place", embedded ? `${cursor + 1} / ${history.length}` : playing ? "live" : `${cursor - last || "newest"}`);
  $("scrub").ariaValueText = `frame ${frame.number}`;
  document.title = frame.title;
  setText("title", frame.title);
  setText("what", `${frame.size.join("×")} ${frame.format}`);
  const facts = { Frame: frame.number, "Lit voxels": frame.n };
  arrivals = arrivals.filter(then => performance.now() - then < 2000);
  if (!embedded) facts["Frames/s"] = arrivals.length / 2;
  if (frame.digest) {
    frame.proved ??= frame.n > 4e5 ? ["", ""] : digest(frame) === frame.digest ? [" ✓", "ok"] : [" ✗", "no"];
    facts.Digest = frame.digest + frame.proved[0];
  }
  for (const [name, value] of Object.entries({ ...facts, ...frame.counters })) {
    if (!$(`fact-${name}`)) $("facts").append(make("dt", { textContent: name }), make("dd", { id: `fact-${name}` }));
    setText(`fact-${name}`, value.toLocaleString("en"));
  }
  if (frame.digest) $("fact-Digest").className = frame.proved[1];
}
setInterval(updateStatus, 400);
let spoken = null;
setInterval(() => {
  const frame = current();
  if (frame && frame !== spoken) announce(`frame ${frame.number}, ${frame.n} lit voxels`);
  spoken = frame;
}, 15000);
