// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

const kClipped = 250;
const kTile = 32;  // px: sharpness is judged for each

// Draws a frame of a camera; over it, in red, what is as bright as the sensor can tell, and in green how sharp each part
// is. @return figures of the frame: the part clipped, and the sharpness (below)
async function drawFrame(canvas, blob, {clipping, sharpness}) {
  const bitmap = await createImageBitmap(blob);
  canvas.width = bitmap.width;
  canvas.height = bitmap.height;
  const context = canvas.getContext("2d", {willReadFrequently: true});
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  if (!canvas.dataset.frames) {  // the first is seen before it is judged; later ones would flicker
    canvas.dataset.frames = "1";
    await new Promise((done) => setTimeout(done));
  }
  const image = context.getImageData(0, 0, canvas.width, canvas.height);
  const {data, width, height} = image;
  const grey = new Uint8Array(width * height);
  let clipped = 0;
  for (let i = 0, at = 0; i < grey.length; ++i, at += 4) {
    grey[i] = data[at];
    if (grey[i] < kClipped) continue;
    ++clipped;
    if (clipping) data[at] = 255, data[at + 1] = data[at + 2] = 0;
  }
  const tiles = sharpnessOfTiles(grey, width, height);
  if (sharpness) {
    for (const tile of tiles.list) {
      const part = tiles.best > 0 ? Math.min(1, tile.sharpness / tiles.best) : 0;
      for (let y = tile.y; y < tile.y + kTile; ++y) {
        for (let x = tile.x, i = 4 * (y * width + x); x < tile.x + kTile; ++x, i += 4)
          data[i + 1] = Math.min(255, data[i + 1] + 110 * part * part);
      }
    }
  }
  context.putImageData(image, 0, 0);
  return {width, height, clipped: clipped / (width * height), sharpness: tiles.typical};
}

// Of a tile: the steepest step between pixels two apart, over the contrast of the tile. 1 is an edge within two pixels;
// blur makes it less, and the light does not matter. Tiles without contrast have none.
function sharpnessOfTiles(grey, width, height) {
  const list = [];
  for (let y = 0; y + kTile <= height; y += kTile) {
    for (let x = 0; x + kTile <= width; x += kTile) {
      let low = 255, high = 0, steepest = 0;
      for (let v = y + 1; v < y + kTile - 1; ++v) {
        for (let i = v * width + x + 1, end = i + kTile - 2; i < end; ++i) {
          if (grey[i] < low) low = grey[i];
          if (grey[i] > high) high = grey[i];
          const across = Math.abs(grey[i + 1] - grey[i - 1]), down = Math.abs(grey[i + width] - grey[i - width]);
          if (across > steepest) steepest = across;
          if (down > steepest) steepest = down;
        }
      }
      if (high - low > 24) list.push({x, y, sharpness: steepest / (high - low)});
    }
  }
  const sorted = list.map((tile) => tile.sharpness).sort((a, b) => a - b);
  return {list, best: sorted[Math.floor(0.95 * (sorted.length - 1))] || 0,
          typical: sorted.length > 0 ? sorted[Math.floor(sorted.length / 2)] : null};
}
