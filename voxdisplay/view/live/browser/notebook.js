// -- The page in a cell of a notebook: see voxdisplay/view/notebook

const given = JSON.parse($("embedded").textContent || null), inCell = !!given?.cell;
document.documentElement.classList.toggle("cell", inCell);
document.documentElement.classList.toggle("still", inCell && given.frames?.length === 1);

const inflate = packed =>
  new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();

// The widget around the page sends frames, and says how things are.
function followWidget() {
  let before = null;
  addEventListener("message", ({ source, data: { state, frame } }) => {
    if (source !== parent) return;
    if (state) setLink(state, state);
    if (frame) before = Promise.all([inflate(frame), before]).then(([buffer]) => push(buffer));
  });
  parent.postMessage("ready", "*");
}
