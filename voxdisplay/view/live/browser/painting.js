"use strict";
// -- Painting

const canvas = $("canvas"), context = canvas.getContext("2d", { alpha: false });
let renderer, probed = null, painted = 0, scheduled = false, turned = 0;
const afterPaint = [];  // callbacks for when the next picture is on the screen

function chooseRenderer() {
  const wish = new URLSearchParams(location.search).get("r");
  if (wish !== "2d") try {
    return new GpuRenderer(wish === "gl");
  } catch (error) { console.info(`rendering on the CPU: ${error.message}`); }
  return new CpuRenderer();
}

function paint() {
  const pixel = Math.min(2, devicePixelRatio || 1), { clientWidth, clientHeight } = $("stage");
  const width = Math.max(1, Math.round(clientWidth * pixel)), height = Math.max(1, Math.round(clientHeight * pixel));
  resizeCanvas(canvas, width, height);
  const frame = visible();
  renderer ??= chooseRenderer();
  drawStage(frame?.size, width, height, pixel);
  context.globalCompositeOperation = "copy";
  context.drawImage(stageCanvas, 0, 0);
  if (!frame) return;
  setGridSize(frame.size);
  if (show.cubes && frame.n <= MOST_CUBES) {
    context.globalCompositeOperation = "source-over";
    drawCubes(context, frame, width, height);
  } else drawLight(frame, width, height, pixel);
  if (probed) outlineProbed(frame, width, height, pixel);
  painted++;
}

function drawLight(frame, width, height, pixel) {
  const q = rasterScale(frame, width, height, pixel), w = Math.ceil(width / q), h = Math.ceil(height / q);
  let light;
  try {
    light = renderer.add(frame, w, h, q, width, height);
  } catch {
    renderer = new CpuRenderer();
    light = renderer.add(frame, w, h, q, width, height);
  }
  const cell = Math.max(1, Math.round(8 * pixel / q)), cells = toneMap(light, w, h, cell);
  context.globalCompositeOperation = "source-over";
  sharp.onto(context, q);
  context.globalCompositeOperation = "screen";
  if (show.glow && frame.n) {
    bloom(cells, 8 * pixel / q / cell);
    scattered.onto(context, q * cell);
  }
}

function outlineProbed({ size }, width, height, pixel) {
  const of = projection(size, width, height);
  context.globalCompositeOperation = "source-over";
  context.strokeStyle = "#fff";
  context.lineWidth = 1.25 * pixel;
  const place = c => project(probed.voxel.map((v, k) => v + (c >> k & 1)), of);
  for (const [a, b] of EDGES) {
    tracePath(context, place(a), place(b));
    context.stroke();
  }
}

function schedule() {
  if (scheduled) return;
  scheduled = true;
  requestAnimationFrame(now => {
    scheduled = false;
    if (show.spin) {
      camera.yaw += Math.min(100, now - turned) / 2500;
      schedule();
    }
    turned = now;
    if (pointer) probe(...pointer);
    paint();
    for (const act of afterPaint.splice(0)) act();
  });
}
