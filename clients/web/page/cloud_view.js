// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// Points are drawn in this order of records: each beginning of it is spread over the whole cloud, so that a part can be
// drawn while it turns.
const kSpread = [0, 16, 8, 24, 4, 20, 12, 28, 2, 18, 10, 26, 6, 22, 14, 30, 1, 17, 9, 25, 5, 21, 13, 29, 3, 19, 11, 27, 7, 23, 15, 31];

// The record of the i-th point that is drawn.
function recordOf(i, count) {
  for (const first of kSpread) {
    const many = Math.max(0, Math.ceil((count - first) / kSpread.length));
    if (i < many) return first + i * kSpread.length;
    i -= many;
  }
  return -1;
}

// @param spread  in the order in which they are drawn; else in that of the records
function column(ply, name, spread = true) {
  const field = ply.fields[name];
  if (!field) return null;
  const values = new Float32Array(ply.count), step = (spread ? kSpread.length : 1) * ply.record;
  const bytes = new Uint8Array(ply.buffer), view = new DataView(ply.buffer);
  const end = ply.begin + ply.count * ply.record;
  let i = 0;
  for (const first of spread ? kSpread : [0]) {
    const begin = ply.begin + first * ply.record + field.offset;
    if (field.type === "uchar") for (let at = begin; at < end; at += step) values[i++] = bytes[at];
    else for (let at = begin; at < end; at += step) values[i++] = view.getFloat32(at, true);
  }
  return values;
}

// Of a field, as rangeOf() has it, without a column of its own.
function rangeOfField(ply, name) {
  const {offset} = ply.fields[name], from = new DataView(ply.buffer, ply.begin), step = Math.max(1, Math.floor(ply.count / 20000));
  return rangeOf(Float32Array.from({length: Math.ceil(ply.count / step)}, (_, i) => from.getFloat32(i * step * ply.record + offset, true)));
}

const positions = (ply) => vectors(ply, 0);

// Of a cloud without cells, whose normals are in its file.
const normalsOf = (ply) => ply.fields.nx ? vectors(ply, ply.fields.nx.offset) : null;

// y and z are turned round, as the screen has y up and looks along -z.
function vectors(ply, offset) {
  const view = new DataView(ply.buffer);
  const values = new Float32Array(3 * ply.count), step = kSpread.length * ply.record;
  const end = ply.begin + ply.count * ply.record;
  let i = 0;
  for (const first of kSpread) {
    for (let at = ply.begin + first * ply.record + offset; at < end; at += step) {
      values[i++] = view.getFloat32(at, true);
      values[i++] = -view.getFloat32(at + 4, true);
      values[i++] = -view.getFloat32(at + 8, true);
    }
  }
  return values;
}

// Colours are worked out once a cloud, not once a frame: without a graphics card each frame would pay for them.
// @param shade  of shadeOf(), or null
function coloursOf(values, [low, high], grey, shade) {
  const table = colourTable(grey);
  const colours = new Uint32Array(values.length), scale = 255 / (high - low);
  for (let i = 0; i < values.length; ++i)
    colours[i] = table[Math.max(0, Math.min(255, Math.round((values[i] - low) * scale)))];
  const bytes = new Uint8ClampedArray(colours.buffer);
  if (shade) {
    let at = 0;
    for (const first of kSpread) {
      for (let record = first; record < values.length; record += kSpread.length, at += 4) {
        const bright = shade.bright[record] / 255 * kFullLight, gloss = shade.gloss[record];
        for (let c = at; c < at + 3; ++c) bytes[c] = bytes[c] * bright + gloss;
      }
    }
  }
  return new Uint8Array(colours.buffer);
}

// The colours that the cloud itself has.
function ownColours(ply) {
  const bytes = new Uint8Array(4 * ply.count).fill(255);
  ["red", "green", "blue"].forEach((name, c) => column(ply, name).forEach((level, i) => bytes[4 * i + c] = level));
  return bytes;
}

const kVertexShader = `
attribute vec4 colour;
uniform float least, most, pitch, lit;
varying vec4 tint;
void main() {
  tint = colour;
  if (lit > 0.5) {
    // Light comes from the upper left, behind the viewer. What is seen from its inside is dark.
    vec3 outward = normalize(normalMatrix * normal);
    bool inside = dot(outward, (modelViewMatrix * vec4(position, 1.0)).xyz) > 0.0;
    tint.rgb *= inside ? 0.3 : 0.35 + 0.65 * max(0.0, dot(outward, normalize(vec3(-0.3, 0.6, 0.75))));
  }
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(position, 1.0));
  gl_PointSize = clamp(pitch * -position.z / gl_Position.w, least, most);
}`;
const kFragmentShader = `
varying vec4 tint;
void main() {
  if (tint.a < 0.5) discard;
  gl_FragColor = vec4(tint.rgb, 1.0);
}`;
const kFill = {symbols: 0.8, pixels: 1.5, model: 1.7};    // of the gap to the neighbours
const kLargest = {symbols: 22, pixels: 16, model: 40};  // px

const kPlain = 0.85;  // grey of a surface that has the colour "plain"
const kBackground = 0x16181c;
const kTurn = 1500, kSlowest = 110, kAim = 80, kFastest = 50, kRest = 300, kPace = 500;  // ms between two frames
const kFew = 50000;  // points that are always drawn

class CloudView {
  // onLost(true) when the browser takes the graphics away, onLost(false) when it draws again.
  constructor(place, onLost) {
    this.place = place;
    this.onLost = onLost;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(40, 4 / 3, 1, 100000);
    this.marks = new THREE.Group();
    this.marks.renderOrder = 1;
    this.scene.add(this.marks);
    this.ply = null;
    this.framed = false;
    this.colour = "z";
    this.shaded = true;
    this.limits = null;  // of depth, mm: what lies outside is not shown
    this.onDrawn = () => {};
    this.drawn = 0;
    this.range = [0, 1];
    this.part = 1;  // of the points, what is drawn while it turns
    this.drawnAt = -Infinity;
    [this.paceBegin, this.paceFrames] = [0, 0];
    this.makeCanvas();
    new ResizeObserver(() => this.resize()).observe(place);
    this.resize();
  }

  // With a material of its own: three.js keeps the state of a renderer in it.
  makeCanvas() {
    this.lost = false;
    this.material = new THREE.ShaderMaterial({
      uniforms: {least: {value: 2}, most: {value: 2}, pitch: {value: 0}, lit: {value: 0}},
      vertexShader: kVertexShader, fragmentShader: kFragmentShader});
    this.renderer = new THREE.WebGLRenderer({antialias: false, preserveDrawingBuffer: false});
    const canvas = this.renderer.domElement;
    this.place.replaceChildren(canvas);
    const target = this.controls ? this.controls.target : new THREE.Vector3();
    if (this.controls) this.controls.dispose();
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.target.copy(target);
    this.controls.update();  // the constructor turned the camera to the origin
    this.controls.addEventListener("change", () => this.draw());
    this.renderer.setClearColor(kBackground);
    canvas.addEventListener("webglcontextlost", () => this.lose());
    canvas.addEventListener("webglcontextrestored", () => this.recover());
  }

  lose() {
    this.lost = true;
    this.renderer.domElement.hidden = true;  // a browser draws a sign of its own there
    this.onLost(true);
  }

  // three.js makes its own state anew, without the colour of the background.
  recover() {
    this.lost = false;
    this.renderer.domElement.hidden = false;
    this.renderer.setClearColor(kBackground);
    this.onLost(false);
    this.resize();
  }

  // On a canvas of its own: browsers that ran short of graphics do not give back those that they took.
  drawAgain() {
    this.renderer.dispose();
    this.makeCanvas();
    this.recover();
    if (this.ply) this.show(this.ply);
  }

  resize() {
    const width = this.place.clientWidth, height = this.place.clientHeight;
    if (width === 0 || height === 0) return;  // another view is chosen
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height);
    if (this.ply) this.setSizes();
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.drawnAt = -Infinity;
    this.draw();
  }

  show(ply) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions(ply), 3));
    const normals = ply.cells ? null : normalsOf(ply);
    if (normals) geometry.setAttribute("normal", new THREE.BufferAttribute(normals, 3));
    this.material.uniforms.lit.value = normals ? 1 : 0;
    if (this.points) {
      this.scene.remove(this.points);
      this.points.geometry.dispose();
    }
    this.points = new THREE.Points(geometry, this.material);
    this.points.frustumCulled = false;
    this.scene.add(this.points);
    this.ply = ply;
    this.drawnAt = -Infinity;  // a new cloud is drawn whole, however soon it comes
    this.paint();
    if (!this.framed && ply.count > 0) this.frameAll();
    this.draw();
  }

  // Whether the points are drawn in the colours of the cloud itself.
  showsOwn() {
    return this.colour === "own" && Boolean(this.ply && this.ply.fields.red);
  }

  // By a column of the cloud; by depth if it has no such column.
  paint() {
    if (!this.ply) return null;
    const plain = this.colour === "plain";
    const values = plain ? new Float32Array(this.ply.count).fill(kPlain) : column(this.ply, this.colour) || column(this.ply, "z");
    const depths = this.limits && column(this.ply, "z");
    const grey = plain || this.colour === "intensity", [near, far] = this.limits || [-Infinity, Infinity];
    this.range = plain ? [0, 1] : grey ? [0, 255] : this.colour === "z" && this.limits ? this.limits : rangeOf(values);
    const colours = this.showsOwn() ? ownColours(this.ply)
      : coloursOf(values, this.range, grey, this.shaded && !grey ? this.shade() : null);
    if (depths) depths.forEach((z, i) => { if (z < near || z > far) colours.fill(0, 4 * i, 4 * i + 4); });
    this.points.geometry.setAttribute("colour", new THREE.BufferAttribute(colours, 4, true));
    this.setSizes();
    this.draw();
    return this.range;
  }

  // Worked out when it is first asked for.
  shade() {
    if (this.ply.shade === undefined) this.ply.shade = shadeOf(this.ply);
    return this.ply.shade;
  }

  // A point is as large as the gap to its neighbours, whatever the zoom.
  setSizes() {
    if (this.ply.pitch === undefined) this.ply.pitch = pitchOf(this.ply);
    const kind = this.ply.fields.symbol ? "symbols" : this.ply.comments.spacing_mm ? "model" : "pixels", {least, most, pitch} = this.material.uniforms;
    const pxPerShare = this.renderer.domElement.height / 2 / Math.tan(this.camera.fov / 2 * Math.PI / 180);
    least.value = this.ply.count > 50000 ? 2 : 4;
    most.value = Math.max(least.value, kLargest[kind]);
    pitch.value = kFill[kind] * this.ply.pitch * pxPerShare;
  }

  frameAll() {
    if (!this.ply || this.ply.count === 0) return;
    const at = this.points.geometry.getAttribute("position").array;
    const axes = [0, 1, 2].map((axis) => rangeOf(at, axis, 3));
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
    requestAnimationFrame((now) => {
      this.waiting = false;
      if (!this.lost) this.render(now);
    });
  }

  // While frames follow one another only so many points are drawn as make ten frames a second; all of them when it rests.
  render(now) {
    const since = now - this.drawnAt;
    const turns = since < kTurn;
    if (turns) this.keepPace(now);
    else [this.paceBegin, this.paceFrames] = [now, 0];
    this.drawnAt = now;
    if (this.points) this.points.geometry.setDrawRange(0, turns ? Math.max(kFew, Math.ceil(this.part * this.ply.count)) : Infinity);
    this.renderer.render(this.scene, this.camera);
    this.onDrawn();
    ++this.drawn;
    clearTimeout(this.rest);
    if (turns && this.part < 1) this.rest = setTimeout(() => {
      this.drawnAt = -Infinity;
      this.draw();
    }, Math.max(kRest, 2 * since));
  }

  // Frames come in bursts, as the browser draws behind what asks for it: their mean over a while counts.
  keepPace(now) {
    ++this.paceFrames;
    const passed = now - this.paceBegin;
    if (passed < kPace) return;
    const mean = passed / this.paceFrames;
    if (mean > kSlowest || mean < kFastest)
      this.part = Math.max(1 / 16, Math.min(1, this.part * Math.max(1 / 4, Math.min(3 / 2, kAim / mean))));
    [this.paceBegin, this.paceFrames] = [now, 0];
  }

  // The index of the point that is seen there: of those within some pixels the nearest to the eye.
  pick(x, y) {
    const at = this.points.geometry.getAttribute("position").array;
    const matrix = new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse);
    const m = matrix.elements, width = this.place.clientWidth, height = this.place.clientHeight;
    const [near, far] = this.limits || [-Infinity, Infinity];
    let best = -1, bestCost = Infinity;
    for (let i = 0, p = 0; p < at.length; ++i, p += 3) {
      if (-at[p + 2] < near || -at[p + 2] > far) continue;
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

  // The record of the point that is seen there, or -1.
  recordAt(x, y) {
    const index = this.points ? this.pick(x, y) : -1;
    return index < 0 ? -1 : recordOf(index, this.ply.count);
  }

  // The edges of boxes in the rig's frame: around the cloud, and of what scans measure; null: none.
  drawBox(around, measured) {
    for (const line of this.boxLines || []) {
      this.scene.remove(line);
      line.geometry.dispose();
      line.material.dispose();
    }
    this.boxLines = [[around, 0x5f6670], [measured, 0xff9d3b]].filter(([box]) => box).map(([box, color]) => {
      const corners = edgesOf(box).flatMap(({ends}) => ends.map(([x, y, z]) => new THREE.Vector3(x, -y, -z)));
      const line = new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(corners), new THREE.LineBasicMaterial({color}));
      line.frustumCulled = false;
      this.scene.add(line);
      return line;
    });
  }

  clearMarks() {
    for (const mark of [...this.marks.children]) {
      this.marks.remove(mark);
      mark.geometry.dispose();
      mark.material.dispose();
    }
  }

  // Each distance as a line between two balls, seen through the cloud.
  drawDistances(measurements) {
    this.clearMarks();
    const onScreen = ({at: [x, y, z]}) => new THREE.Vector3(x, -y, -z);
    const reach = this.camera.position.distanceTo(this.controls.target) / 150;
    for (const point of measurements.points()) {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(reach, 12, 8), new THREE.MeshBasicMaterial({color: 0xffffff, depthTest: false}));
      ball.position.copy(onScreen(point));
      this.marks.add(ball);
    }
    for (const {a, b} of measurements.distances) {
      const geometry = new THREE.BufferGeometry().setFromPoints([onScreen(a), onScreen(b)]);
      const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({color: 0xffffff, depthTest: false}));
      line.frustumCulled = false;
      this.marks.add(line);
    }
    this.draw();
  }
}
