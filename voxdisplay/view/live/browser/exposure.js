"use strict";
// -- Exposure, as in voxdisplay/view/picture.py

const TONES = 8192, TOP = 16;
const SRGB = Uint8Array.from({ length: 4097 }, (_, i) => Math.round(255 * (i / 4096) ** (1 / 2.2)));
const TONE = new Float32Array(TONES), WHITE = new Float32Array(TONES);
for (let i = 0; i < TONES; i++) {
  const most = (i + 0.5) * TOP / TONES, toned = 1 - Math.exp(-most), white = 0.35 * toned ** 5;
  TONE[i] = 4096 * toned * (1 - white) / most;
  WHITE[i] = 4096 * toned * white;
}

function autoExposure(light, w, h) {
  const apart = Math.max(1, Math.round(Math.sqrt(w * h / 32768))), samples = [];
  let top = 0;
  for (let row = 0; row < h; row += apart)
    for (let column = 0, o = 4 * row * w; column < w; column += apart, o += 4 * apart) {
      const most = Math.max(light[o], light[o + 1], light[o + 2]);
      if (most > 1e-4) samples.push(most);
      top = Math.max(top, most);
    }
  const lit = Float32Array.from(samples).filter(most => most > top / 50).sort();
  return lit.length ? 1.6094 / lit[Math.floor(0.92 * (lit.length - 1))] : 1;
}

// A canvas that is drawn pixel by pixel, and enlarged.
class Raster {
  canvas = document.createElement("canvas");
  #context = this.canvas.getContext("2d", { willReadFrequently: true });
  #image = null;
  words(w, h) {
    if (this.#image?.width !== w || this.#image.height !== h) {
      Object.assign(this.canvas, { width: w, height: h });
      this.#image = this.#context.createImageData(w, h);
    }
    return new Uint32Array(this.#image.data.buffer);
  }
  onto(context, q) {
    this.#context.putImageData(this.#image, 0, 0);
    context.drawImage(this.canvas, 0, 0, this.canvas.width * q, this.canvas.height * q);
  }
}
const sharp = new Raster(), scattered = new Raster();
const word = (r, g, b, a = 255) => a << 24 | b << 16 | g << 8 | r;

// Map light to sRGB, as opaque as it is bright: it stands before the background. Return its averages
// over cells, for the bloom.
function toneMap(light, w, h, cell) {
  const out = sharp.words(w, h), gain = autoExposure(light, w, h) * 2 ** $("exposure").value, steps = TONES * gain / TOP;
  const cw = Math.ceil(w / cell), coarse = new Float32Array(3 * cw * Math.ceil(h / cell)), share = 1 / cell / cell;
  for (let row = 0, i = 0, o = 0; row < h; row++) {
    const base = Math.floor(row / cell) * cw;
    for (let column = 0; column < w; column++, i++, o += 4) {
      const r = light[o], g = light[o + 1], b = light[o + 2];
      const most = r > g ? (r > b ? r : b) : (g > b ? g : b);
      if (most < 1e-5) { out[i] = 0; continue; }
      const step = Math.min(TONES - 1, most * steps | 0), scale = TONE[step] * gain, white = WHITE[step];
      const red = SRGB[r * scale + white | 0], green = SRGB[g * scale + white | 0], blue = SRGB[b * scale + white | 0];
      const top = Math.max(red, green, blue), full = 255 / top;
      out[i] = word(red * full, green * full, blue * full, top);
      const c = 3 * (base + (column / cell | 0));
      coarse[c] += red * share; coarse[c + 1] += green * share; coarse[c + 2] += blue * share;
    }
  }
  return { coarse, cw };
}

// Bloom: the sum of a narrow and a wide blur. A unit is 8 pixels.
function bloom({ coarse, cw }, unit) {
  const ch = coarse.length / 3 / cw;
  const narrow = blur(coarse, cw, ch, Math.sqrt(0.8) * unit), wide = blur(coarse, cw, ch, Math.sqrt(12) * unit);
  const sum = wide.map((v, i) => 0.6 * narrow[i] + 0.8 * v), gain = Math.min(3, 72 / sum.reduce((a, b) => Math.max(a, b), 1));
  const out = scattered.words(cw, ch);
  for (let i = 0, o = 0; i < out.length; i++) out[i] = word(sum[o++] * gain, sum[o++] * gain, sum[o++] * gain);
}

function blur(planes, w, h, sigma) {
  const reach = Math.ceil(2.2 * sigma), weights = gaussian(reach, reach, sigma);
  const pass = (from, count, step, lines, apart) => {
    const to = new Float32Array(from.length);
    for (let line = 0; line < lines; line++)
      for (let i = 0, o = line * apart; i < count; i++, o += step)
        for (let t = Math.max(-reach, -i); t <= reach && i + t < count; t++) {
          const share = weights[t + reach], p = o + t * step;
          to[o] += share * from[p]; to[o + 1] += share * from[p + 1]; to[o + 2] += share * from[p + 2];
        }
    return to;
  };
  return pass(pass(planes, w, 3, h, 3 * w), h, 3 * w, w, 3);
}
