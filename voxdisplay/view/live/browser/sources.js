"use strict";
// -- Sources of frames: a server, or this file

let tries = 0;
function connect() {
  const socket = new WebSocket(new URL("live", location.href.replace("http", "ws")));
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => {
    push(data);
    // Acknowledge when it is on the screen; a hidden page does not paint.
    afterPaint.push(() => socket.readyState === 1 && socket.send("shown"));
  };
  let opened = false;
  socket.onopen = () => { opened = true; tries = 0; refusal(""); setState("live"); };
  socket.onclose = async () => {
    afterPaint.length = 0;
    const why = opened ? "" : await reason();
    refusal(why);
    setState(why ? "refused" : "reconnecting");
    setTimeout(connect, why ? 5000 : Math.min(2000, 200 * 1.6 ** tries++));
  };
}
// Ask why the WebSocket was refused, which a script cannot see; empty if the server is down.
async function reason() {
  try {
    const answer = await fetch(new URL(`live?origin=${encodeURIComponent(location.origin)}`, location.href));
    return [403, 426].includes(answer.status) ? (await answer.text()).trim() : "";
  } catch { return ""; }
}
function refusal(why) {
  $("refusal").hidden = !why;
  // An option is not broken at its hyphens.
  $("refusal").replaceChildren(...why.split(/(--[\w-]+)/).map((part, i) => i % 2 ? make("b", { textContent: part }) : part));
}

async function unpack() {
  const { fps, frames } = embedded;
  for (const text of frames) push(await inflate(Uint8Array.from(atob(text), c => c.charCodeAt(0))));
  setPlaying(frames.length > 1 && !matchMedia("(prefers-reduced-motion: reduce)").matches);
  setInterval(() => playing && seek((cursor + 1) % history.length), 1000 / fps);
}

if (given?.frames) {
  embedded = given;
  setState("recording");
  unpack();
} else if (inCell) followWidget();
else connect();
new ResizeObserver(schedule).observe(area);
if (!inCell) area.focus({ preventScroll: true });  // a notebook keeps the focus
updateStatus();
schedule();
