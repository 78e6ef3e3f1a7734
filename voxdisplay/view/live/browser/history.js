"use strict";
// -- History: the last frames, and which of them is shown

const MOST_FRAMES = 900, MOST_BYTES = 128e6;
const history = [];
let cursor = -1, playing = true, keptBytes = 0, embedded = null, arrivals = [];
// State of the connection, in a word and in words; when the server was last heard.
let link = ["connecting", "connecting"], heard = 0;

// Frames are kept as messages; only the one that is shown is decoded.
let shown = { buffer: null, frame: null };
function current() {
  const buffer = history[cursor];
  if (buffer && shown.buffer !== buffer) shown = { buffer, frame: decode(buffer) };
  return buffer ? shown.frame : null;
}

function push(buffer) {
  const { view, number } = headOf(buffer);
  if (!history.length) beginView(view);
  history.push(buffer);
  keptBytes += buffer.byteLength;
  while (!embedded && history.length > 1 && (history.length > MOST_FRAMES || keptBytes > MOST_BYTES)) {
    keptBytes -= history.shift().byteLength;
    cursor = Math.max(0, cursor - 1);
  }
  if (cursor < 0 || playing && !embedded) cursor = history.length - 1;
  arrivals.push([performance.now(), number]);
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
// Return the state in a word and in words, and whether what is seen is old.
function stateNow() {
  const after = history.length - 1 - cursor, silent = performance.now() - heard;
  if (embedded?.frames.length === 1) return ["still", "still picture"];
  if (embedded) return Array(2).fill(playing ? "playing" : "paused");
  if (link[0] !== "live") return [...link, history.length];
  if (!inCell && silent > 6000) return ["silent", `no answer for ${Math.round(silent / 1000)} s`, true];
  if (!playing) return ["paused", after ? `paused, ${after} behind` : "paused"];
  const came = arrivals.length - 1, sent = came > 0 ? arrivals[came][1] - arrivals[0][1] : 0;
  if (came > 0 && sent > 1.3 * came + 1) return ["behind", `behind: shows ${Math.round(came / sent * 100)} % of the frames`];
  return ["live", "live"];
}
function setState() {
  const [is, words, old] = stateNow(), it = $("state");
  if (it.dataset.is !== is) announce(words);
  it.dataset.is = is;
  it.toggleAttribute("data-old", !!old);
  setText("state", words);
}
const announce = text => setText("announcement", text);

const ABOUT = {
  Frame: "Number of the picture, counted by its source", "Lit voxels": "Voxels that are not dark",
  "Frames/s": "Pictures that came in the last two seconds, a second",
  Digest: "Check value by the device; \u2713: that of what is drawn is the same",
  Packets: "Packets that the device has received", Refused: "Packets with wrong contents",
  Damaged: "Packets that came damaged, and are sent again", Overruns: "Times that the receive buffer was full",
  "Bytes sent": "Bytes sent to the device",
};
const HINT = ({ port }) => port ? `Show something: voxdisplay push SCENE.json --port ${port}` : "The port is held by this view: end it to push.";

// Update the texts about the frame that is shown; called at intervals that can be read.
function updateStatus() {
  const frame = current(), last = history.length - 1;
  arrivals = arrivals.filter(([then]) => performance.now() - then < 2000);
  setState();
  $("playback").hidden = embedded?.frames.length === 1;
  $("scrub").max = Math.max(0, last);
  $("scrub").value = cursor;
  $("first").disabled = $("previous").disabled = cursor <= 0;
  $("next").disabled = cursor >= last;
  if (!frame) return;
  setText("place", embedded ? `${cursor + 1} / ${history.length}` : playing ? "newest" : `${cursor - last || "newest"}`);
  $("hint").hidden = frame.n;
  setText("hint", embedded ? "Nothing is lit in this picture." : `Nothing is lit. ${HINT(frame)}`);
  $("coloring").hidden = !frame.scalar;
  $("scrub").ariaValueText = `frame ${frame.number}`;
  document.title = frame.title;
  setText("title", frame.title);
  setText("what", `${frame.size.join("×")} ${frame.format}`);
  const facts = { Frame: frame.number, "Lit voxels": frame.n };
  if (!embedded) facts["Frames/s"] = arrivals.length / 2;
  if (frame.digest) {
    frame.proved ??= frame.n > 4e5 ? ["", ""] : digest(frame) === frame.digest ? [" ✓", "ok"] : [" ✗", "no"];
    facts.Digest = frame.digest + frame.proved[0];
  }
  for (const [name, value] of Object.entries({ ...facts, ...frame.counters })) {
    if (!$(`fact-${name}`)) $("facts").append(make("dt", { textContent: name, title: ABOUT[name] ?? "" }), make("dd", { id: `fact-${name}` }));
    setText(`fact-${name}`, value.toLocaleString("en"));
  }
  if (frame.digest) $("fact-Digest").className = frame.proved[1];
}
let spoken = null;
setInterval(() => {
  const frame = current();
  if (frame && frame !== spoken) announce(`frame ${frame.number}, ${frame.n} lit voxels`);
  spoken = frame;
}, 15000);
