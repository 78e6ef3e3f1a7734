"use strict";
// -- Light: additive splatting as in voxdisplay/view/glow.py, on the CPU or the GPU

const LINEAR = Float32Array.from({ length: 256 }, (_, c) => (c / 255) ** 2.2);
// Standard deviation of a voxel's spot, in pixels.
const splatSigma = px => Math.max(0.42, px * (0.22 + 0.23 / (1 + (px / 6) ** 2)));
// Radius of a spot in pixels; of large ones so great that their edge is not visible.
const splatRadius = sigma => Math.ceil((sigma > 2 ? 3.8 : 2.2) * sigma);

// Weights that fall off on both sides of the middle; their sum is 1.
function gaussian(reach, middle, sigma) {
  const taps = Float32Array.from({ length: 2 * reach + 1 }, (_, i) => Math.exp(-(((i - middle) / sigma) ** 2) / 2));
  const sum = taps.reduce((a, b) => a + b);
  return taps.map(tap => tap / sum);
}

// A spot's profile, for eight positions of its centre between two pixels.
const profiles = new Map();
function profile(sigma) {
  const key = Math.round(Math.log(sigma) * 24);
  if (!profiles.has(key)) {
    const s = Math.exp(key / 24), reach = splatRadius(s), taps = 2 * reach + 1;
    const weights = new Float32Array(8 * taps);
    for (let phase = 0; phase < 8; phase++)
      weights.set(gaussian(reach, reach - 0.5 + (phase + 0.5) / 8, s).map(tap => tap * s * 2.5066), phase * taps);
    profiles.set(key, { reach, taps, weights });
  }
  return profiles.get(key);
}

// Pixels per cell of the raster: many large spots are drawn on a coarser one and enlarged.
function rasterScale({ n, size }, width, height, pixel) {
  const sigma = splatSigma(projection(size, width, height).k / camera.distance / Math.max(...size));
  let q = Math.max(pixel, Math.sqrt(width * height / 1.5e6));
  while (sigma / q > 0.75 && n * (2 * splatRadius(sigma / q) + 1) ** 2 > renderer.most) q *= 1.25;
  return q;
}

// Buffer of the light: (h, w, 4) floats, of which the last is not used.
let sums = [];
const lightBuffer = (w, h) => sums.length === 4 * w * h ? sums : sums = new Float32Array(4 * w * h);

// Splatting on the CPU.
class CpuRenderer {
  most = 1.2e6;  // pixels splatted for a picture, at most

  add(frame, w, h, q, width, height) {
    const light = lightBuffer(w, h).fill(0), of = projection(frame.size, width, height), seen = projectAll(frame, of);
    const { k, L } = of, D = camera.distance, [R, G, B] = frame.colors, spots = [], ghost = ghostLight(frame.n);
    for (let i = 0, at = 0; i < frame.n; i++) {
      const px = seen[at++] / q, py = seen[at++] / q, cut = seen[at] < 0, near = D / Math.abs(seen[at++]);
      if (cut && !ghost) continue;
      const alike = near * 20 | 0;
      const { reach, taps, weights } = spots[alike] ??= profile(Math.max(0.42, splatSigma(k * (alike + 0.5) / 20 / D / L) / q));
      const ix = Math.floor(px), iy = Math.floor(py);
      const left = Math.max(0, ix - reach), end = Math.min(w - 1, ix + reach);
      const top = Math.max(0, iy - reach), bottom = Math.min(h - 1, iy + reach);
      const wx = ((px - ix) * 8 | 0) * taps + left - ix + reach;
      let wy = ((py - iy) * 8 | 0) * taps + top - iy + reach;
      const strength = near * near * (cut ? ghost : 1), r = LINEAR[R[i]] * strength, g = LINEAR[G[i]] * strength, b = LINEAR[B[i]] * strength;
      for (let row = top; row <= bottom; row++) {
        const share = weights[wy++];
        for (let c = left, t = wx, o = 4 * (row * w + left); c <= end; c++, t++, o += 4) {
          const s = share * weights[t];
          light[o] += r * s; light[o + 1] += g * s; light[o + 2] += b * s;
        }
      }
    }
    return light;
  }
}

// Splatting on the GPU: points blended in half floats, and read back.
const PLACE = `
in float x, y, z, r, g, b;
uniform vec4 right, up, depth, lensing, rim;  // k, distance, longest side, q; middle, size
uniform vec3 low, high;
uniform float ghost;
out vec4 spot;
out float sigma;
void main() {
  vec3 at = vec3(x, y, z);
  vec4 p = vec4(at + 0.5, 1.0);
  float d = dot(depth, p), k = lensing.x / d, near = lensing.y / d, px = k / lensing.z;
  sigma = max(0.42, max(0.42, px * (0.22 + 0.23 / (1.0 + px * px / 36.0))) / lensing.w);
  vec2 place = (rim.xy + k * vec2(dot(right, p), -dot(up, p))) / lensing.w;
  bool cut = any(lessThan(at, low)) || any(greaterThan(at, high));
  gl_Position = cut && ghost == 0.0 ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(place / rim.zw * 2.0 - 1.0, 0.0, 1.0);
  gl_PointSize = 2.0 * ceil((sigma > 2.0 ? 3.8 : 2.2) * sigma) + 1.0;
  spot = vec4(pow(vec3(r, g, b), vec3(2.2)) * near * near * (cut ? ghost : 1.0), gl_PointSize);
}`;
const SHINE = `
in vec4 spot;
in float sigma;
out vec4 light;
void main() {
  vec2 away = (gl_PointCoord - 0.5) * spot.w / sigma;
  light = vec4(spot.rgb * exp(-dot(away, away) / 2.0), 1.0);
}`;
class GpuRenderer {
  most = 1e8;
  #gl; #made; #frame; #light;

  constructor(anyway) {
    const gl = this.#gl = document.createElement("canvas").getContext("webgl2");
    if (!["", "half_"].some(kind => gl?.getExtension(`EXT_color_buffer_${kind}float`)))
      throw new Error("WebGL2 with blending of half floats is not available");
    const about = gl.getExtension("WEBGL_debug_renderer_info");
    const machine = about && gl.getParameter(about.UNMASKED_RENDERER_WEBGL);
    if (!anyway && /swiftshader|llvmpipe|soft|basic render/i.test(machine)) throw new Error(machine);
    const made = this.#made = gl.createProgram();
    const shader = (kind, text) => {
      const it = gl.createShader(kind);
      gl.shaderSource(it, "#version 300 es\nprecision highp float;\n" + text);
      gl.compileShader(it);
      gl.attachShader(made, it);
    };
    shader(gl.VERTEX_SHADER, PLACE);
    shader(gl.FRAGMENT_SHADER, SHINE);
    [..."xyzrgb"].forEach((name, i) => gl.bindAttribLocation(made, i, name));
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    gl.useProgram(made);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
  }

  #upload(frame) {
    const gl = this.#gl, planes = [...frame.positions, ...frame.colors];
    const size = Math.max(4, 2 * frame.n + 3 & ~3);
    gl.bufferData(gl.ARRAY_BUFFER, 6 * size, gl.STREAM_DRAW);
    planes.forEach((plane, i) => {
      const kind = plane.BYTES_PER_ELEMENT === 2 ? gl.UNSIGNED_SHORT : gl.UNSIGNED_BYTE;
      gl.bufferSubData(gl.ARRAY_BUFFER, i * size, plane);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, 1, kind, i > 2, 0, i * size);
    });
    this.#frame = frame;
  }

  add(frame, w, h, q, width, height) {
    const gl = this.#gl, of = projection(frame.size, width, height);
    if (this.#light !== lightBuffer(w, h)) {
      this.#light = lightBuffer(w, h);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, w, h, 0, gl.RGBA, gl.HALF_FLOAT, null);
    }
    if (frame !== this.#frame) this.#upload(frame);
    const set = (name, ...v) => gl[`uniform${v.length}fv`](gl.getUniformLocation(this.#made, name), v);
    for (const name of ["right", "up", "depth"]) set(name, ...of[name]);
    set("lensing", of.k, camera.distance, of.L, q);
    set("rim", of.x, of.y, w, h);
    set("ghost", ghostLight(frame.n));
    set("low", ...slices.map(s => s[0]));
    set("high", ...slices.map(s => s[1]));
    gl.viewport(0, 0, w, h);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.drawArrays(gl.POINTS, 0, frame.n);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.FLOAT, this.#light);
    if (gl.isContextLost()) throw new Error("the GPU context is lost");
    return this.#light;
  }
}
