// Widget around the page of the live view, for anywidget. Traits: page (HTML), height (pixels); of
// a live view also latest (a message, deflated) and state (what the page says of it).
const GONE = "no kernel: last picture";
const PATIENCE_MS = 10000;  // a live view says every few seconds that it is there

function render({ model, el }) {
  const cell = document.createElement("iframe");
  Object.assign(cell, { title: "3-D view", allow: "fullscreen", srcdoc: model.get("page") });
  cell.style.cssText = `display: block; width: 100%; height: ${model.get("height")}px; border: 0; border-radius: 6px`;
  el.append(cell);
  if (model.get("latest") === undefined) return;
  const post = said => cell.contentWindow?.postMessage(said, "*");
  const isGone = () => el.closest(".jupyter-widgets-disconnected");
  const say = () => post({ state: isGone() ? GONE : model.get("state") });
  let heard = 0;
  const hear = act => () => { heard = performance.now(); act(); };
  const show = state => {
    const { buffer, byteOffset, byteLength } = model.get("latest");
    post({ frame: buffer.slice(byteOffset, byteOffset + byteLength), state });
  };
  // A notebook that moves the cell loads the page again: then it is ready again, too.
  const ready = ({ source }) => {
    if (source !== cell.contentWindow) return;
    show(GONE);  // until the kernel answers
    model.send({ kind: "hello" });
  };
  addEventListener("message", ready);
  model.on("change:latest", hear(() => show(model.get("state"))));
  model.on("change:state msg:custom", hear(say));
  model.on("comm_live_update", say);
  const watch = setInterval(() => {
    if (model.get("state") === "live" && performance.now() - heard > PATIENCE_MS) post({ state: GONE });
  }, PATIENCE_MS / 4);
  return () => {
    clearInterval(watch);
    removeEventListener("message", ready);
  };
}

export default { render };
