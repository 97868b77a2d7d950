// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// What is written over the cloud in space: numbers along the edges of its box, a scale bar, and the numbers of distances.
const kAxes = ["x", "y", "z"], kAxisTicks = 5, kShortestAxis = 60;  // px
const kBarShare = 0.25;  // of the view's width, at most

// The box around nearly all points, mm, x right, y down, z away; none without points.
function boxOf(ply) {
  if (ply.count === 0) return null;
  return kAxes.map((name) => rangeOfField(ply, name));
}

const corner = (box, [i, j, k]) => [box[0][i], box[1][j], box[2][k]];

// The twelve edges of a box, each with its axis.
function edgesOf(box) {
  const edges = [];
  for (let axis = 0; axis < 3; ++axis) {
    const others = [0, 1, 2].filter((other) => other !== axis);
    for (const [p, q] of [[0, 0], [0, 1], [1, 0], [1, 1]]) {
      const ends = [0, 1].map((end) => {
        const sides = [0, 0, 0];
        [sides[axis], sides[others[0]], sides[others[1]]] = [end, p, q];
        return corner(box, sides);
      });
      edges.push({axis, ends});
    }
  }
  return edges;
}

class SpaceOverlay {
  constructor(canvas, view) {
    [this.canvas, this.view, this.bar] = [canvas, view, null];
    this.box = null;
    this.measurements = null;
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio, 2), {clientWidth: width, clientHeight: height} = this.view.place;
    [this.canvas.width, this.canvas.height] = [width * ratio, height * ratio];
    this.ratio = ratio;
  }

  // Where a point of the rig's frame is on the screen, px; null behind the eye.
  onScreen([x, y, z]) {
    const p = new THREE.Vector3(x, -y, -z).project(this.view.camera);
    if (p.z > 1) return null;
    return [(p.x + 1) / 2 * this.canvas.width / this.ratio, (1 - p.y) / 2 * this.canvas.height / this.ratio];
  }

  draw() {
    if (this.canvas.width === 0) return;
    const context = this.canvas.getContext("2d");
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.font = "12px system-ui, sans-serif";
    [context.lineJoin, context.lineWidth] = ["round", 3];
    [context.fillStyle, context.strokeStyle] = ["#e8eaed", "#16181c"];
    if (this.box) for (let axis = 0; axis < 3; ++axis) this.drawAxis(context, axis);
    if (this.box) this.drawScale(context);
    if (this.measurements) this.measurements.distances.forEach(({a, b}, i) => {
      const [from, to] = [a, b].map(({at}) => this.onScreen(at));
      if (from && to) this.write(context, String(i + 1), (from[0] + to[0]) / 2 + 6, (from[1] + to[1]) / 2 - 6);
    });
  }

  write(context, text, x, y) {
    context.strokeText(text, x, y);
    context.fillText(text, x, y);
  }

  // Along the edge that is lowest on the screen; of upright ones along the leftmost.
  drawAxis(context, axis) {
    const seen = edgesOf(this.box).filter((edge) => edge.axis === axis)
      .map(({ends}) => ({ends, screen: ends.map((end) => this.onScreen(end))})).filter(({screen}) => screen[0] && screen[1]);
    if (seen.length === 0) return;
    const isUpright = ({screen: [a, b]}) => Math.abs(b[1] - a[1]) > Math.abs(b[0] - a[0]);
    const upright = isUpright(seen[0]), rank = ({screen: [a, b]}) => upright ? -(a[0] + b[0]) : a[1] + b[1];
    const {ends, screen: [from, to]} = seen.reduce((best, edge) => rank(edge) > rank(best) ? edge : best);
    const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (length < kShortestAxis) return;
    const [low, high] = this.box[axis], step = tickStep(high - low, Math.min(kAxisTicks, length / 50));
    context.textAlign = upright ? "right" : "center";
    context.textBaseline = upright ? "middle" : "top";
    for (const value of ticksOf(low, high, step)) {
      const share = (value - low) / (high - low), at = this.onScreen(ends[0].map((start, i) => start + share * (ends[1][i] - start)));
      if (at) this.write(context, tickLabel(value, step), at[0] - (upright ? 5 : 0), at[1] + (upright ? 0 : 4));
    }
    const end = from[1] < to[1] ? from : to;
    if (upright) this.write(context, kAxes[axis] + " mm", end[0] - 5, end[1] - 10);
    else this.write(context, kAxes[axis] + " mm", (from[0] + to[0]) / 2, (from[1] + to[1]) / 2 + 18);
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
  }

  // True amid the view: nearer things look larger.
  drawScale(context) {
    const width = this.canvas.width / this.ratio, height = this.canvas.height / this.ratio;
    const away = this.view.camera.position.distanceTo(this.view.controls.target);
    const pxPerMm = height / 2 / Math.tan(this.view.camera.fov / 2 * Math.PI / 180) / away;
    const most = kBarShare * width / pxPerMm, power = 10 ** Math.floor(Math.log10(most));
    const mm = [5, 2, 1].find((factor) => factor * power <= most) * power, px = mm * pxPerMm;
    this.bar = {mm, px};
    const right = width - 12, y = 18;
    context.fillRect(right - px, y, px, 3);
    for (const x of [right - px, right - 1]) context.fillRect(x, y - 4, 1, 11);
    context.textAlign = "center";
    this.write(context, `${tickLabel(mm, mm)} mm`, right - px / 2, y - 6);
    context.textAlign = "left";
  }
}
