"use strict";
// -- Sources of frames: a server, or this file

let tries = 0;
function connect() {
  const socket = new WebSocket(new URL("live", location.href.replace("http", "ws")));
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => {
    heard = performance.now();
    if (data === "pong") return;
    if (dropped) dropped.live = [data];
    else push(data);
    // Acknowledge when it is on the screen; a hidden page does not paint.
    afterPaint.push(() => socket.readyState === 1 && socket.send("shown"));
  };
  let opened = false;
  // The server answers, even while the display shows the same for long.
  const asking = setInterval(() => socket.readyState === 1 && socket.send("ping"), 2000);
  socket.onopen = () => { opened = true; tries = 0; heard = performance.now(); refusal(""); setLink("live", "live"); };
  socket.onclose = async ({ code, reason: said }) => {
    clearInterval(asking);
    afterPaint.length = 0;
    const why = opened ? "" : await reason();
    refusal(why);
    if (why) setLink("refused", "refused");
    else if (code === 1001 || code === 1011) setLink("ended", `ended: ${said || "last picture"}`);
    else if (link[0] !== "ended") setLink("disconnected", "disconnected, trying again");
    setTimeout(connect, why ? 5000 : Math.min(2000, 200 * 1.6 ** tries++));
  };
}
function setLink(...is) {
  link = is;
  updateStatus();
}
// Ask why the WebSocket was refused, which a script cannot see; empty if the server is down, or
// is just ending: where pictures came through before, an upgrade is possible.
async function reason() {
  try {
    const answer = await fetch(new URL(`live?origin=${encodeURIComponent(location.origin)}`, location.href));
    const refused = answer.status === 403 || answer.status === 426 && !history.length;
    return refused ? (await answer.text()).trim() : "";
  } catch { return ""; }
}
function refusal(why) {
  $("refusal").hidden = !why;
  // An option is not broken at its hyphens.
  $("refusal").replaceChildren(...why.split(/(--[\w-]+)/).map((part, i) => i % 2 ? make("b", { textContent: part }) : part));
}

let film = 0;
async function unpack() {
  const mine = embedded, { fps, frames } = mine, moves = frames.length > 1 && !matchMedia("(prefers-reduced-motion: reduce)").matches;
  for (const text of frames) {
    const buffer = await inflate(Uint8Array.from(atob(text), c => c.charCodeAt(0)));
    if (embedded !== mine) return;  // another file has been dropped
    push(buffer);
  }
  setPlaying(moves);
  if (moves && !location.hash) setShow("spin", true);
  film = setInterval(() => playing && seek((cursor + 1) % history.length), 1000 / fps);
}

// A file that is dropped on the page is read by the server; what was live goes on behind it.
const MOST_DROPPED = 32 << 20, PIECE = 1 << 15;
let dropped = null;
function showFile(file) {
  if (inCell || embedded && !dropped) return refusal("This page is a file: drop it on a page of voxdisplay view.");
  if (file.size > MOST_DROPPED) return refusal(`${file.name}: larger than ${MOST_DROPPED >> 20} MiB`);
  const socket = new WebSocket(new URL(`drop?name=${encodeURIComponent(file.name)}`, location.href.replace("http", "ws")));
  refusal(`${file.name} is read`);
  socket.onopen = async () => {
    const data = await file.arrayBuffer();
    for (let at = 0; at < data.byteLength; at += PIECE) socket.send(data.slice(at, at + PIECE));
    socket.send("");
  };
  socket.onclose = () => refusal(`${file.name} was not read: the server does not answer`);
  socket.onmessage = ({ data }) => {
    socket.onclose = null;
    const { error, ...got } = JSON.parse(data);
    refusal(error ? `${file.name}: ${error}` : "");
    if (error) return;
    clearInterval(film);
    dropped ??= { live: history.slice(-1) };
    embedded = got;
    history.length = 0;
    cursor = -1;
    $("back").hidden = false;
    unpack();
  };
}
$("back").onclick = () => {
  clearInterval(film);
  const live = dropped.live;
  dropped = embedded = null;
  $("back").hidden = true;
  history.length = 0;
  cursor = -1;
  live.forEach(push);
  setPlaying(true);
};
addEventListener("dragover", event => event.preventDefault());
addEventListener("drop", event => {
  event.preventDefault();
  if (event.dataTransfer.files[0]) showFile(event.dataTransfer.files[0]);
});

if (given?.frames) {
  embedded = given;
  unpack();
} else if (inCell) followWidget();
else connect();
new ResizeObserver(schedule).observe(area);
if (!inCell) area.focus({ preventScroll: true });  // a notebook keeps the focus
updateStatus();
// Not before: between two scripts of a page that loads slowly there is time for a timer.
setInterval(updateStatus, 400);
schedule();
