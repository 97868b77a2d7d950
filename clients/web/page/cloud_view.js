// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

const kSizes = {float: 4, uchar: 1, double: 8, int: 4, uint: 4, short: 2, ushort: 2, char: 1};

// A binary little-endian PLY as slsd writes it: a header, and one record a point.
function readPly(buffer) {
  const bytes = new Uint8Array(buffer);
  const head = new TextDecoder("latin1").decode(bytes.subarray(0, 4096));
  const end = head.indexOf("end_header\n");
  if (end < 0) throw new Error("the cloud is no PLY");
  const header = head.slice(0, end);
  const count = Number(/^element vertex (\d+)$/m.exec(header)[1]);
  const fields = {};
  let record = 0;
  for (const [, type, name] of header.matchAll(/^property (\w+) (\w+)$/gm)) {
    fields[name] = {type, offset: record};
    record += kSizes[type];
  }
  const begin = end + "end_header\n".length;
  if (buffer.byteLength < begin + count * record) throw new Error("the cloud is cut off");
  return {buffer, begin, count, record, fields};
}

function column(ply, name) {
  const field = ply.fields[name];
  if (!field) return null;
  const values = new Float32Array(ply.count);
  if (field.type === "uchar") {
    const bytes = new Uint8Array(ply.buffer);
    for (let i = 0, at = ply.begin + field.offset; i < ply.count; ++i, at += ply.record) values[i] = bytes[at];
  } else {
    const view = new DataView(ply.buffer);
    for (let i = 0, at = ply.begin + field.offset; i < ply.count; ++i, at += ply.record)
      values[i] = view.getFloat32(at, true);
  }
  return values;
}

// y and z are turned round, as the screen has y up and looks along -z.
function positions(ply) {
  const view = new DataView(ply.buffer);
  const values = new Float32Array(3 * ply.count);
  let at = ply.begin;
  for (let i = 0; i < values.length; i += 3, at += ply.record) {
    values[i] = view.getFloat32(at, true);
    values[i + 1] = -view.getFloat32(at + 4, true);
    values[i + 2] = -view.getFloat32(at + 8, true);
  }
  return values;
}

// The same records under another header; the names of normals are those that readers of PCD expect.
function pcdOf(ply) {
  const names = Object.keys(ply.fields).map((name) => ({nx: "normal_x", ny: "normal_y", nz: "normal_z"})[name] || name);
  const fields = Object.values(ply.fields);
  const header = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS " + names.join(" ") +
    "\nSIZE " + fields.map((field) => kSizes[field.type]).join(" ") +
    "\nTYPE " + fields.map((field) => (field.type === "float" ? "F" : "U")).join(" ") +
    "\nCOUNT " + fields.map(() => 1).join(" ") + "\nWIDTH " + ply.count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
    ply.count + "\nDATA binary\n";
  return new Blob([header, new Uint8Array(ply.buffer, ply.begin, ply.count * ply.record)]);
}

// Where most of the values are: from so small a part of them to so large a one.
function rangeOf(values) {
  const step = Math.max(1, Math.floor(values.length / 20000));
  const some = [];
  for (let i = 0; i < values.length; i += step) some.push(values[i]);
  some.sort((a, b) => a - b);
  if (some.length === 0) return [0, 1];
  const low = some[Math.floor(0.01 * (some.length - 1))], high = some[Math.ceil(0.99 * (some.length - 1))];
  return high > low ? [low, high] : [low, low + 1];
}

const kVertexShader = `
attribute float value;
uniform float low, high, size;
uniform int grey;
varying vec3 tint;
vec3 turbo(float x) {  // Mikhailov 2019, the polynomial approximation
  vec4 r = vec4(0.13572138, 4.61539260, -42.66032258, 132.13108234);
  vec4 g = vec4(0.09140261, 2.19418839, 4.84296658, -14.18503333);
  vec4 b = vec4(0.10667330, 12.64194608, -60.58204836, 110.36276771);
  vec4 p = vec4(1.0, x, x * x, x * x * x);
  vec2 q = p.zw * p.z;
  return clamp(vec3(dot(p, r) + dot(q, vec2(-152.94239396, 59.28637943)),
                    dot(p, g) + dot(q, vec2(4.27729857, 2.82956604)),
                    dot(p, b) + dot(q, vec2(-89.90310912, 27.34824973))), 0.0, 1.0);
}
void main() {
  float x = clamp((value - low) / (high - low), 0.0, 1.0);
  tint = grey == 1 ? vec3(0.08 + 0.92 * x) : turbo(0.05 + 0.9 * x);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_PointSize = size;
}`;
const kFragmentShader = "varying vec3 tint; void main() { gl_FragColor = vec4(tint, 1.0); }";

class CloudView {
  constructor(place) {
    this.place = place;
    this.renderer = new THREE.WebGLRenderer({antialias: false, preserveDrawingBuffer: false});
    this.renderer.setClearColor(0x16181c);
    place.append(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(40, 4 / 3, 1, 100000);
    this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    this.material = new THREE.ShaderMaterial({
      uniforms: {low: {value: 0}, high: {value: 1}, size: {value: 2}, grey: {value: 0}},
      vertexShader: kVertexShader, fragmentShader: kFragmentShader});
    this.marks = new THREE.Group();
    this.scene.add(this.marks);
    this.picked = [];
    this.ply = null;
    this.framed = false;
    this.colour = "z";
    this.drawn = 0;
    new ResizeObserver(() => this.resize()).observe(place);
    this.resize();
  }

  resize() {
    const width = this.place.clientWidth, height = this.place.clientHeight;
    if (width === 0 || height === 0) return;  // another view is chosen
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  show(buffer) {
    const ply = readPly(buffer);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions(ply), 3));
    if (this.points) {
      this.scene.remove(this.points);
      this.points.geometry.dispose();
    }
    this.points = new THREE.Points(geometry, this.material);
    this.points.frustumCulled = false;
    this.scene.add(this.points);
    this.ply = ply;
    this.picked = [];
    this.marks.clear ? this.marks.clear() : this.marks.remove(...this.marks.children);
    this.paint();
    if (!this.framed && ply.count > 0) this.frameAll();
    this.draw();
  }

  // By a column of the cloud; by depth where it has no such column.
  paint() {
    if (!this.ply) return null;
    const values = column(this.ply, this.colour) || column(this.ply, "z");
    const [low, high] = this.colour === "intensity" ? [0, 255] : rangeOf(values);
    this.points.geometry.setAttribute("value", new THREE.BufferAttribute(values, 1));
    const uniforms = this.material.uniforms;
    uniforms.low.value = low;
    uniforms.high.value = high;
    uniforms.grey.value = this.colour === "intensity" ? 1 : 0;
    uniforms.size.value = this.ply.count > 50000 ? 2 : 4;
    this.draw();
    return [low, high];
  }

  get range() { return [this.material.uniforms.low.value, this.material.uniforms.high.value]; }

  frameAll() {
    if (!this.ply || this.ply.count === 0) return;
    const at = this.points.geometry.getAttribute("position").array;
    const axes = [0, 1, 2].map((axis) => rangeOf(at.filter((_, i) => i % 3 === axis)));
    const centre = axes.map(([low, high]) => (low + high) / 2);
    const [wide, high, deep] = axes.map(([low, high]) => 1.1 * (high - low) / 2);
    this.controls.target.set(...centre);
    const reach = Math.max(1, high, wide / this.camera.aspect);
    const distance = reach / Math.tan((this.camera.fov / 2) * Math.PI / 180) + deep;
    this.camera.position.set(centre[0], centre[1], centre[2] + distance);
    this.camera.near = distance / 100;
    this.camera.far = distance * 20;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.framed = true;
    this.draw();
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.renderer.render(this.scene, this.camera);
      ++this.drawn;
    });
  }

  // The index of the point that is seen there: of those within some pixels the nearest to the eye.
  pick(x, y) {
    const at = this.points.geometry.getAttribute("position").array;
    const matrix = new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse);
    const m = matrix.elements, width = this.place.clientWidth, height = this.place.clientHeight;
    let best = -1, bestCost = Infinity;
    for (let i = 0, p = 0; p < at.length; ++i, p += 3) {
      const w = m[3] * at[p] + m[7] * at[p + 1] + m[11] * at[p + 2] + m[15];
      if (w <= 0) continue;
      const u = (m[0] * at[p] + m[4] * at[p + 1] + m[8] * at[p + 2] + m[12]) / w;
      const v = (m[1] * at[p] + m[5] * at[p + 1] + m[9] * at[p + 2] + m[13]) / w;
      const off = Math.hypot((u + 1) / 2 * width - x, (1 - v) / 2 * height - y);
      const cost = w * (1 + off / 100);
      if (off < 12 && cost < bestCost) [best, bestCost] = [i, cost];
    }
    return best;
  }

  point(index) {
    const at = this.points.geometry.getAttribute("position").array.slice(3 * index, 3 * index + 3);
    const sigma = column(this.ply, "sigma_mm"), camera = column(this.ply, "camera");
    return {at: [at[0], -at[1], -at[2]], sigma: sigma ? sigma[index] : NaN, first: !camera || camera[index] === 0};
  }

  // Marks a point; with the second of two, the distance between them and its standard deviation: each point is uncertain
  // along its ray, and of that what points along the line between them counts. Rays of other cameras than the first do
  // not come from the origin: theirs counts in full.
  mark(x, y) {
    const index = this.points ? this.pick(x, y) : -1;
    if (index < 0) return null;
    if (this.picked.length === 2) this.picked = [], this.marks.remove(...this.marks.children);
    this.picked.push(this.point(index));
    const [px, py, pz] = this.picked[this.picked.length - 1].at;
    const reach = this.camera.position.distanceTo(this.controls.target) / 120;
    const ball = new THREE.Mesh(new THREE.SphereGeometry(reach, 12, 8), new THREE.MeshBasicMaterial({color: 0xffffff}));
    ball.position.set(px, -py, -pz);
    this.marks.add(ball);
    this.draw();
    if (this.picked.length < 2) return {points: 1};
    const [a, b] = this.picked;
    const between = a.at.map((value, axis) => b.at[axis] - value);
    const distance = Math.hypot(...between);
    const along = (point) => {
      if (!point.first || distance === 0) return point.sigma;
      const length = Math.hypot(...point.at);
      return point.sigma * Math.abs(point.at.reduce((sum, value, axis) => sum + value * between[axis], 0)) / length / distance;
    };
    return {points: 2, distance, sigma: Math.hypot(along(a), along(b))};
  }
}
