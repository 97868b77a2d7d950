// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// Light on a surface as in the pictures of --cloud-picture: from the upper left, behind the scanner. Worked out once a cloud.
const kAmbient = 0.42, kDiffuse = 0.66, kGloss = 0.16, kGlossExponent = 24, kFullLight = kAmbient + kDiffuse;
const kSteepest = 4;  // a neighbour so many times deeper than it is far aside lies beyond an edge
const kReach = {symbols: 1, pixels: 3};  // cells to the neighbours that give the slope: pixels alone are noisy

const unit = (v) => v.map((value) => value / Math.hypot(...v));
const kLight = unit([-0.30, -0.62, -0.72]), kHalfway = unit([kLight[0], kLight[1], kLight[2] - 1]);

// The differences to the neighbour on the one side and to that on the other, of which one may lack.
function slope(at, places, record, before, after) {
  let [from, to] = [record, record];
  for (const [neighbour, is_after] of [[before, false], [after, true]]) {
    if (neighbour < 0) continue;
    const dx = places[0][neighbour] - places[0][record], dy = places[1][neighbour] - places[1][record];
    if (Math.abs(places[2][neighbour] - places[2][record]) > kSteepest * Math.hypot(dx, dy)) continue;
    if (is_after) to = neighbour;
    else from = neighbour;
  }
  for (let axis = 0; axis < 3; ++axis) at[axis] = places[axis][to] - places[axis][from];
  return from !== to;
}

// Of each record, in their order: how bright its colour is, of 255 for full light, and how much gloss is added. Where the
// slope is unknown the colour stays as it is. @return null without cells
function shadeOf(ply) {
  if (!ply.cells) return null;
  const {columns, rows, at} = ply.cells, reach = ply.fields.symbol ? kReach.symbols : kReach.pixels;
  const places = ["x", "y", "z"].map((name) => column(ply, name, false));
  const bright = new Uint8Array(ply.count).fill(Math.round(255 / kFullLight)), gloss = new Uint8Array(ply.count);
  const across = [0, 0, 0], down = [0, 0, 0];
  for (let row = 0, cell = 0; row < rows; ++row) {
    for (let c = 0; c < columns; ++c, ++cell) {
      const record = at[cell];
      if (record < 0) continue;
      const left = c >= reach ? at[cell - reach] : -1, right = c + reach < columns ? at[cell + reach] : -1;
      const above = row >= reach ? at[cell - reach * columns] : -1, below = row + reach < rows ? at[cell + reach * columns] : -1;
      if (!slope(across, places, record, left, right) || !slope(down, places, record, above, below)) continue;
      let x = across[1] * down[2] - across[2] * down[1], y = across[2] * down[0] - across[0] * down[2];
      let z = across[0] * down[1] - across[1] * down[0];
      const length = (z > 0 ? -1 : 1) * Math.sqrt(x * x + y * y + z * z);
      if (length === 0) continue;
      [x, y, z] = [x / length, y / length, z / length];
      const lit = kAmbient + kDiffuse * Math.max(0, x * kLight[0] + y * kLight[1] + z * kLight[2]);
      const shine = Math.max(0, x * kHalfway[0] + y * kHalfway[1] + z * kHalfway[2]);
      bright[record] = Math.round(255 * lit / kFullLight);
      gloss[record] = Math.round(255 * kGloss * shine ** kGlossExponent);
    }
  }
  return {bright, gloss};
}

const mean = ([low, high]) => (low + high) / 2;

// How far apart neighbours are, as a share of their depth: so large a point is drawn that no gaps are left. 0: unknown
function pitchOf(ply) {
  if (!ply.cells) return ply.comments.spacing_mm ? Number(ply.comments.spacing_mm) / mean(rangeOfField(ply, "z")) : 0;
  const {columns, at} = ply.cells, found = [];
  const [x, y, z] = ["x", "y", "z"].map((name) => column(ply, name, false));
  const step = Math.max(1, Math.floor(at.length / 20000));
  for (let cell = 0; cell + columns < at.length; cell += step) {
    const [here, right, below] = [at[cell], at[cell + 1], at[cell + columns]];
    if (here < 0) continue;
    for (const other of [right, below]) if (other >= 0) found.push(Math.hypot(x[other] - x[here], y[other] - y[here]) / z[here]);
  }
  found.sort((a, b) => a - b);
  return found.length === 0 ? 0 : found[Math.floor(found.length / 2)];
}
