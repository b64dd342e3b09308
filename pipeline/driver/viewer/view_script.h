#pragma once
// Scripts of the viewer's page.

#include <string_view>

namespace drench {

/// Matrices (column-major), shaders, buffers.
inline constexpr std::string_view view_graphics = R"js(
const canvas = document.querySelector('canvas'), gl = canvas.getContext('webgl2', {antialias: true});
const sub = (a, b) => a.map((v, k) => v - b[k]), add = (a, b) => a.map((v, k) => v + b[k]);
const scale = (a, s) => a.map(v => v * s), dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => scale(a, 1 / Math.hypot(...a));
// right, up, forward: unit axes of the camera at `eye`.
function looking(eye, right, up, forward, halfWidth, aspect, near, far) {
  const x = 1 / halfWidth, y = aspect / halfWidth, z = -(far + near) / (far - near), w = -2 * far * near / (far - near);
  const back = scale(forward, -1), rows = [right, up, back].map(a => [...a, -dot(a, eye)]);
  const out = new Float32Array(16);
  for (let c = 0; c < 4; ++c) {
    out[4 * c] = x * rows[0][c]; out[4 * c + 1] = y * rows[1][c];
    out[4 * c + 2] = z * rows[2][c] + (c === 3 ? w : 0); out[4 * c + 3] = -rows[2][c];
  }
  return out;
}
const common = `#version 300 es
precision highp float;
vec3 colour(float t) {
  vec3 stops[5] = vec3[](vec3(.11,.25,.58), vec3(.18,.61,.85), vec3(.5,.84,.71), vec3(.96,.83,.37), vec3(.93,.35,.21));
  float u = clamp(t, 0., 1.) * 4.; int k = min(int(u), 3);
  return mix(stops[k], stops[k + 1], u - float(k));
}`;
const programs = {
  points: [common + `
layout(location=0) in vec3 at; layout(location=1) in vec4 values;
uniform mat4 view; uniform vec3 low, size; uniform vec4 slice, which; uniform float pixels, radius;
out vec3 shade; out float cut;
void main() {
  vec3 p = low + at * size;
  gl_Position = view * vec4(p, 1);
  gl_PointSize = clamp(pixels * radius / gl_Position.w, 1., 64.);
  shade = colour(dot(values, which)); cut = dot(slice.xyz, p) - slice.w;
}`, common + `
in vec3 shade; in float cut; out vec4 pixel;
void main() {
  vec2 d = gl_PointCoord * 2. - 1.; float r = dot(d, d);
  if (r > 1. || cut > 0.) discard;
  pixel = vec4(shade * (.45 + .55 * sqrt(1. - r) * (.75 - .25 * d.y)), 1);
}`],
  mesh: [common + `
layout(location=0) in vec3 at; layout(location=1) in vec4 normal; layout(location=2) in vec2 values;
uniform mat4 view; uniform vec4 slice; uniform vec2 which, range;
out vec3 n, p; out float value, cut;
void main() {
  gl_Position = view * vec4(at, 1); n = normal.xyz; p = at;
  value = (dot(values, which) - range.x) / max(range.y - range.x, 1e-9); cut = dot(slice.xyz, at) - slice.w;
}`, common + `
in vec3 n, p; in float value, cut; uniform vec3 base, eye; uniform float coloured, opacity; out vec4 pixel;
void main() {
  if (cut > 0.) discard;
  vec3 m = normalize(n), v = normalize(eye - p);
  if (dot(m, v) < 0.) m = -m;
  float light = .3 + .5 * max(dot(m, normalize(vec3(.4, .8, .45))), 0.) + .2 * dot(m, v);
  float rim = pow(1. - max(dot(m, v), 0.), 3.);
  pixel = vec4(mix(base, colour(value), coloured) * light + .15 * rim, mix(opacity, 1., opacity < 1. ? rim : 1.));
}`],
  lines: [common + `
layout(location=0) in vec3 at; uniform mat4 view;
void main() { gl_Position = view * vec4(at, 1); gl_PointSize = 9.; }`, common + `
uniform vec3 base; out vec4 pixel; void main() { pixel = vec4(base, 1); }`],
};
for (const name in programs) {
  const program = gl.createProgram();
  programs[name].forEach((source, k) => {
    const shader = gl.createShader(k ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
    gl.shaderSource(shader, source); gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(name + ': ' + gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  });
  gl.linkProgram(program);
  const uniforms = {};
  for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++k) {
    const info = gl.getActiveUniform(program, k); uniforms[info.name] = gl.getUniformLocation(program, info.name);
  }
  programs[name] = {program, uniforms};
}
function vertexArray(data, columns, index) {
  const array = gl.createVertexArray(); gl.bindVertexArray(array);
  const buffer = gl.createBuffer(); gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  columns.forEach(([size, type, whole, stride, offset], k) => {
    gl.enableVertexAttribArray(k); gl.vertexAttribPointer(k, size, type, whole, stride, offset);
  });
  const buffers = [buffer];
  if (index) {
    const elements = gl.createBuffer(); gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, elements);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW); buffers.push(elements);
  }
  gl.bindVertexArray(null);
  return {array, free: () => { gl.deleteVertexArray(array); buffers.forEach(b => gl.deleteBuffer(b)); }};
}
function particlesOf(bytes) {
  const head = new DataView(bytes), f = k => head.getFloat32(12 + 4 * k, true);
  const columns = [[3, gl.UNSIGNED_SHORT, true, 10, 0], [4, gl.UNSIGNED_BYTE, true, 10, 6]];
  return {...vertexArray(new Uint8Array(bytes, 52), columns), all: head.getUint32(4, true), count: head.getUint32(8, true),
          low: [f(0), f(1), f(2)], size: [f(3), f(4), f(5)], ranges: {speed: [0, f(6)], density: [f(7), f(8)], age: [0, f(9)]}};
}
function meshOf(bytes) {
  const head = new DataView(bytes), vertices = head.getUint32(4, true), triangles = head.getUint32(8, true);
  const normal = 12 * vertices, values = normal + 4 * vertices, end = values + 8 * vertices;
  const columns = [[3, gl.FLOAT, false, 12, 0], [4, gl.BYTE, true, 4, normal], [2, gl.FLOAT, false, 8, values]];
  const ranges = [[Infinity, -Infinity], [0, 1]], column = new Float32Array(bytes, 16 + values, 2 * vertices);
  for (let k = 0; k < vertices; ++k) { ranges[0][0] = Math.min(ranges[0][0], column[2 * k]); ranges[0][1] = Math.max(ranges[0][1], column[2 * k]); }
  return {...vertexArray(new Uint8Array(bytes, 16, end), columns, new Uint32Array(bytes, 16 + end, 3 * triangles)), count: 3 * triangles, ranges};
}
)js";

/// What is shown, keys, mouse, and what is fetched.
inline constexpr std::string_view view_script = R"js(
const $ = id => document.getElementById(id), slider = document.querySelector('#bar input'), button = document.querySelector('#bar button');
const root = location.pathname, moving = 300000, resting = 4000000;
let scene, at = 0, playing = 0, shown = {sheets: []}, asked = 0, eye = {yaw: .6, pitch: .35, distance: 2, target: [0, 0, 0], half_width: .45};
window.drench = {get state() { return {frame: scene && scene.frames[at].frame, particles: shown.particles ? shown.particles.count : 0, all: shown.particles ? shown.particles.all : 0, sheets: shown.sheets.filter(Boolean).length, fluid: !!shown.fluid, camera: $('camera').checked, playing: !!playing, error: $('said').textContent}; }};
const get = async what => {
  const answer = await fetch(root + what);
  if (!answer.ok) throw new Error(await answer.text());
  return answer;
};
async function load(most) {
  const turn = ++asked, frame = scene.frames[at], f = 'frame=' + frame.frame, next = {sheets: []}, jobs = [];
  const take = (what, make, put) => jobs.push(get(what).then(a => a.arrayBuffer()).then(bytes => put(make(bytes))));
  if (frame.particles && $('particles').checked) take('particles?' + f + '&most=' + most, particlesOf, v => next.particles = v);
  if (frame.fluid && $('fluid').checked) take('fluid?' + f, meshOf, v => next.fluid = v);
  if ($('sheets').checked) frame.sheets.forEach((there, k) => { if (there) take('cloth?' + f + '&sheet=' + k, meshOf, v => next.sheets[k] = v); });
  const failed = (await Promise.allSettled(jobs)).find(j => j.status === 'rejected');
  const free = set => [set.particles, set.fluid, ...set.sheets].forEach(v => v && v.free());
  if (turn !== asked) return free(next);
  free(shown); shown = next;
  $('said').textContent = failed ? failed.reason.message : '';
  draw();
  // The whole of it once nothing moves.
  if (!playing && next.particles && next.particles.count < next.particles.all && most < resting) setTimeout(() => { if (turn === asked) load(resting); }, 250);
}
function show(k) {
  at = Math.max(0, Math.min(scene.frames.length - 1, k));
  slider.value = at; $('number').textContent = scene.frames[at].frame;
  return load(moving);
}
function play(on) {
  playing = on ? performance.now() : 0; button.textContent = on ? 'pause' : 'play';
  if (!on) { if (scene) load(moving); return; }
  const start = playing, first = at;
  (async () => {
    while (playing === start) {
      const due = first + Math.floor((performance.now() - start) / 1000 * scene.fps);
      await show(due % scene.frames.length);
      await new Promise(requestAnimationFrame);
    }
  })();
}
function pose() {
  const frame = scene.frames[at].camera;
  if ($('camera').checked) return frame;
  const {yaw, pitch, distance, target} = eye, c = Math.cos(pitch);
  const forward = scale([Math.sin(yaw) * c, Math.sin(pitch), Math.cos(yaw) * c], -1), right = unit(cross(forward, [0, 1, 0]));
  return {position: sub(target, scale(forward, distance)), right, up: cross(right, forward), forward, half_width: eye.half_width};
}
// On from where the shot's camera stands, about what it sees of the middle of the domain.
function leaveCamera() {
  if (!$('camera').checked) return;
  const {position, forward, half_width} = scene.frames[at].camera, middle = scale(add(scene.low, scene.high), .5);
  const distance = Math.max(dot(sub(middle, position), forward), .1 * Math.hypot(...sub(scene.high, scene.low)));
  eye = {yaw: Math.atan2(-forward[0], -forward[2]), pitch: Math.asin(-forward[1]), distance, target: add(position, scale(forward, distance)), half_width};
  $('camera').checked = false;
}
function use(name, values) {
  const {program, uniforms} = programs[name]; gl.useProgram(program);
  for (const key in values) {
    const v = values[key], where = uniforms[key];
    if (where === undefined) continue;
    if (v.length === 16) gl.uniformMatrix4fv(where, false, v);
    else if (v.length) gl['uniform' + v.length + 'fv'](where, v);
    else gl.uniform1f(where, v);
  }
}
function drawMesh(mesh, view, from, base, which, range, coloured, opacity, slice) {
  use('mesh', {view, slice, which, range, base, eye: from, coloured, opacity});
  gl.bindVertexArray(mesh.array); gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
}
function drawFrame(view) {
  const [a, b] = [scene.low, scene.high], corner = k => [0, 1, 2].map(c => k >> c & 1 ? b[c] : a[c]), points = [];
  for (let k = 0; k < 8; ++k) for (let c = 0; c < 3; ++c) if (!(k >> c & 1)) points.push(...corner(k), ...corner(k | 1 << c));
  const box = vertexArray(new Float32Array(points), [[3, gl.FLOAT, false, 12, 0]]);
  use('lines', {view, base: [.45, .5, .6]}); gl.bindVertexArray(box.array); gl.drawArrays(gl.LINES, 0, points.length / 3); box.free();
  if (!scene.probes.length) return;
  const marks = vertexArray(new Float32Array(scene.probes.flatMap(p => p.position)), [[3, gl.FLOAT, false, 12, 0]]);
  use('lines', {view, base: [1, .45, .3]}); gl.bindVertexArray(marks.array); gl.drawArrays(gl.POINTS, 0, scene.probes.length); marks.free();
}
function legend() {
  const colour = $('colour').value, cloth = $('cloth').value, sheet = shown.sheets.find(Boolean);
  const range = cloth !== 'shade' && sheet ? sheet.ranges[cloth === 'stretch' ? 0 : 1] : shown.particles ? shown.particles.ranges[colour] : [0, 0];
  const unit = cloth !== 'shade' && sheet ? '' : {speed: ' m/s', density: ' kg/m3', age: ' s'}[colour];
  document.querySelectorAll('#ends span').forEach((span, k) => span.textContent = range[k].toPrecision(3) + unit);
}
function draw() {
  if (!scene) return;
  const ratio = devicePixelRatio || 1, width = Math.round(innerWidth * ratio), height = Math.round(innerHeight * ratio);
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  const p = pose(), aspect = width / height, far = 20 * Math.hypot(...sub(scene.high, scene.low)) + eye.distance;
  // The shot's camera keeps its whole picture in the window.
  const half = $('camera').checked && aspect > scene.aspect ? p.half_width * aspect / scene.aspect : p.half_width;
  const view = looking(p.position, p.right, p.up, p.forward, half, aspect, far * 1e-4, far);
  const axis = {x: 0, y: 1, z: 2}[$('axis').value], slice = [0, 0, 0, 1];
  if (axis !== undefined) { slice[axis] = 1; slice[3] = scene.low[axis] + $('slice').value * (scene.high[axis] - scene.low[axis]); }
  gl.viewport(0, 0, width, height); gl.clearColor(.078, .086, .102, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST); gl.disable(gl.BLEND);
  const cloth = $('cloth').value, wetness = cloth === 'wetness';
  for (const sheet of shown.sheets) if (sheet) drawMesh(sheet, view, p.position, [.72, .66, .58], wetness ? [0, 1] : [1, 0], sheet.ranges[wetness ? 1 : 0], cloth === 'shade' ? 0 : 1, 1, slice);
  if (shown.particles) {
    const q = shown.particles, thin = Math.cbrt(q.all / Math.max(1, q.count)), which = {speed: [1, 0, 0, 0], density: [0, 1, 0, 0], age: [0, 0, 1, 0]}[$('colour').value];
    use('points', {view, low: q.low, size: q.size, slice, which, pixels: width / half, radius: .55 * scene.spacing * Math.min(thin, 2)});
    gl.bindVertexArray(q.array); gl.drawArrays(gl.POINTS, 0, q.count);
  }
  if ($('frame').checked) drawFrame(view);
  if (shown.fluid) {
    gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    drawMesh(shown.fluid, view, p.position, [.35, .62, .85], [1, 0], shown.fluid.ranges[0], 0, shown.particles ? .35 : .75, slice);
  }
  legend();
  const q = shown.particles; if (!$('said').textContent || $('said').dataset.counts) { $('said').dataset.counts = 1; $('said').textContent = q ? q.count === q.all ? q.all + ' particles' : q.count + ' of ' + q.all + ' particles' : ''; }
}
canvas.addEventListener('pointermove', event => {
  if (!event.buttons || !scene) return;
  leaveCamera();
  if (event.shiftKey || event.buttons & 6) {
    const p = pose(), by = 2 * p.half_width * eye.distance / innerWidth;
    eye.target = add(eye.target, add(scale(p.right, -event.movementX * by), scale(p.up, event.movementY * by)));
  } else {
    eye.yaw -= .006 * event.movementX; eye.pitch = Math.max(-1.55, Math.min(1.55, eye.pitch + .006 * event.movementY));
  }
  draw();
});
canvas.addEventListener('wheel', event => { if (!scene) return; leaveCamera(); eye.distance *= Math.exp(.0012 * event.deltaY); draw(); event.preventDefault(); }, {passive: false});
canvas.addEventListener('contextmenu', event => event.preventDefault());
slider.addEventListener('input', () => { play(false); show(+slider.value); });
button.addEventListener('click', () => play(!playing));
for (const id of ['particles', 'sheets', 'fluid']) $(id).addEventListener('change', () => load(moving));
for (const id of ['frame', 'camera', 'colour', 'cloth', 'axis']) $(id).addEventListener('change', draw);
$('slice').addEventListener('input', draw);
addEventListener('resize', draw);
const flip = id => () => $(id).click();
document.addEventListener('keydown', event => {
  if (!scene || event.ctrlKey || event.metaKey || event.altKey) return;
  const keys = {ArrowRight: () => { play(false); show(at + 1); }, ArrowLeft: () => { play(false); show(at - 1); }, Home: () => show(0), End: () => show(scene.frames.length - 1),
                ' ': () => play(!playing), p: flip('particles'), k: flip('sheets'), m: flip('fluid'), d: flip('frame'), c: flip('camera')};
  const key = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (key && event.target.tagName !== 'SELECT') { event.preventDefault(); key(); }
});
(async () => {
  scene = await (await get('scene.json')).json();
  document.title = scene.shot; document.querySelector('h1').textContent = scene.shot;
  slider.max = scene.frames.length - 1;
  eye.target = scale(add(scene.low, scene.high), .5); eye.distance = 1.1 * Math.hypot(...sub(scene.high, scene.low));
  const there = scene.frames.findIndex(f => f.particles || f.fluid || f.sheets.some(Boolean));
  $('camera').checked = true;
  await show(Math.max(0, there));
})().catch(error => $('said').textContent = error.message);
)js";

}  // namespace drench
