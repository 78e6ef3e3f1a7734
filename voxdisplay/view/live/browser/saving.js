"use strict";
// -- Saving

function download(blob, name) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
function savePng() {
  paint();
  canvas.toBlob(blob => download(blob, `voxdisplay-${current()?.number ?? 0}.png`));
}
let recorder = null;
function recording(on) {
  $("record").ariaPressed = on;
  setText("record", on ? "Stop" : "Record");
}
function record() {
  if (recorder) return recorder.stop();
  const type = ["video/mp4", "video/webm"].find(t => MediaRecorder.isTypeSupported(t));
  recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: type, videoBitsPerSecond: 8e6 });
  const parts = [];
  recorder.ondataavailable = event => parts.push(event.data);
  recorder.onstop = () => {
    download(new Blob(parts, { type }), `voxdisplay.${type.slice(6)}`);
    recorder = null;
    recording(false);
  };
  recorder.start(250);
  recording(true);
  schedule();
}
