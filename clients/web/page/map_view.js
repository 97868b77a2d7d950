// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// Maps in the camera's pixels: depth, sigma, and what is clipped in the frame. Each pixel knows its point of the cloud.

const kNoPoint = 0xff2c2622;  // dark, as a pixel of a canvas

// The record of the point at each pixel of a camera, or -1. A pixel of a dense cloud has its own; a symbol fills its
// surroundings. @param size  of the camera's picture; null without such a cloud
function recordsOfPixels(ply, camera, size) {
  if (ply.fields.camera_u) return recordsOfSymbols(ply, camera, size);
  if (!ply.cells) return null;
  const {columns, rows, at, firstRow} = ply.cells;
  const begin = firstRow[camera] ?? 0, end = firstRow.find((row, other) => other > camera && row !== undefined) ?? rows;
  return {width: columns, height: end - begin, at: at.subarray(begin * columns, end * columns)};
}

function recordsOfSymbols(ply, camera, {width, height}) {
  const at = new Int32Array(width * height).fill(-1), from = new DataView(ply.buffer, ply.begin);
  const {camera_u: u, camera_v: v, camera: which} = ply.fields, places = [];
  for (let i = 0, base = 0; i < ply.count; ++i, base += ply.record) {
    if (from.getUint8(base + which.offset) !== camera) continue;
    places.push([i, from.getFloat32(base + u.offset, true), from.getFloat32(base + v.offset, true)]);
  }
  const half = spacingOf(places) / 2;
  for (const [record, x, y] of places) {
    const left = Math.max(0, Math.round(x - half)), right = Math.min(width - 1, Math.round(x + half));
    for (let row = Math.max(0, Math.round(y - half)); row <= Math.min(height - 1, Math.round(y + half)); ++row)
      at.fill(record, row * width + left, row * width + right + 1);
  }
  return {width, height, at};
}

// Half of the symbols have their nearest one closer than this.
function spacingOf(places) {
  const step = Math.max(1, Math.floor(places.length / 100)), nearest = [];
  for (let i = 0; i < places.length; i += step) {
    let best = Infinity;
    for (const other of places) {
      if (other !== places[i]) best = Math.min(best, Math.hypot(other[1] - places[i][1], other[2] - places[i][2]));
    }
    nearest.push(best);
  }
  nearest.sort((a, b) => a - b);
  return Math.min(100, nearest[Math.floor(nearest.length / 2)] || 1);
}

class MapView {
  constructor(canvas) {
    this.canvas = canvas;
    this.records = null;
  }

  // @param kind    "z", "sigma_mm" or "clipping"
  // @param frame   with "clipping": of askFrame()
  // @param limits  of depth: others are left out
  // @return        the range of its colours, or what part is clipped; null: this cloud has no map
  draw(ply, camera, size, kind, frame, limits) {
    this.ply = ply;
    this.records = recordsOfPixels(ply, camera, kind === "clipping" ? frame : size);
    if (kind === "clipping") return this.drawClipping(frame);
    if (!this.records) return null;
    const {width, height, at} = this.records, values = column(ply, kind, false), depths = column(ply, "z", false);
    fitCanvas(this.canvas, this.records);
    const range = kind === "z" && limits ? limits : rangeOf(values), table = colourTable(false);
    const image = new ImageData(width, height), pixels = new Uint32Array(image.data.buffer), scale = 255 / (range[1] - range[0]);
    for (let i = 0; i < at.length; ++i) {
      const record = at[i];
      const shown = record >= 0 && (!limits || (depths[record] >= limits[0] && depths[record] <= limits[1]));
      pixels[i] = shown ? table[Math.max(0, Math.min(255, Math.round((values[record] - range[0]) * scale)))] : kNoPoint;
    }
    this.canvas.getContext("2d").putImageData(image, 0, 0);
    return {range};
  }

  drawClipping(frame) {
    fitCanvas(this.canvas, frame);
    const image = imageOf(frame), pixels = new Uint32Array(image.data.buffer);
    let clipped = 0;
    for (let i = 0; i < frame.grey.length; ++i) {
      if (frame.grey[i] < kClipped) continue;
      ++clipped;
      pixels[i] = 0xff0000ff;
    }
    this.canvas.getContext("2d").putImageData(image, 0, 0);
    return {clipped: clipped / frame.grey.length};
  }

  // The pixel at a place of the canvas as it is shown.
  pixelAt(x, y) {
    const {width, height} = this.canvas;
    return [Math.floor(x / this.canvas.clientWidth * width), Math.floor(y / this.canvas.clientHeight * height)];
  }

  // The record of the point at a pixel, or -1.
  recordAt([u, v]) {
    if (!this.records || u < 0 || v < 0 || u >= this.records.width || v >= this.records.height) return -1;
    return this.records.at[v * this.records.width + u];
  }

  // The pixel that shows a point: of its symbol, or its own.
  pixelOf(record) {
    const {camera_u: u, camera_v: v} = this.ply.fields, base = this.ply.begin + record * this.ply.record;
    const from = new DataView(this.ply.buffer);
    if (u) return [from.getFloat32(base + u.offset, true), from.getFloat32(base + v.offset, true)];
    const i = this.records ? this.records.at.indexOf(record) : -1;
    return i < 0 ? null : [i % this.records.width, Math.floor(i / this.records.width)];
  }

  // Over what is drawn already: each distance as a line with its number.
  drawDistances({distances, pending}) {
    const context = this.canvas.getContext("2d"), unit = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    const dot = (pixel) => {
      context.beginPath();
      context.arc(...pixel, 4 * unit, 0, 7);
      context.fill();
      context.stroke();
    };
    [context.fillStyle, context.strokeStyle, context.lineWidth] = ["#fff", "#000", 1.5 * unit];
    context.font = `${14 * unit}px system-ui, sans-serif`;
    distances.forEach(({a, b}, i) => {
      const from = this.pixelOf(a.record), to = this.pixelOf(b.record);
      if (!from || !to) return;
      for (const [colour, wide] of [["#000", 4], ["#fff", 2]]) {
        [context.strokeStyle, context.lineWidth] = [colour, wide * unit];
        context.beginPath();
        context.moveTo(...from);
        context.lineTo(...to);
        context.stroke();
      }
      [context.strokeStyle, context.lineWidth] = ["#000", 1.5 * unit];
      dot(from);
      dot(to);
      context.lineWidth = 3 * unit;
      const middle = [(from[0] + to[0]) / 2 + 6 * unit, (from[1] + to[1]) / 2 - 6 * unit];
      context.strokeText(String(i + 1), ...middle);
      context.fillText(String(i + 1), ...middle);
    });
    const first = pending && this.pixelOf(pending.record);
    if (first) dot(first);
  }
}
