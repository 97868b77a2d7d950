// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

const kClipped = 250;
const kTile = 32;  // px: sharpness is judged for each

// What a camera sees: to code and decode a picture takes longer than to send it.
// @param as_shown  as it is; else the projector shows the pattern
async function askFrame(camera, as_shown = true) {
  const response = await ask(`api/frame?format=raw${as_shown ? "&as_shown=1" : ""}&camera=${encodeURIComponent(camera)}`);
  const {width_px: width, height_px: height, bits} = aboutOf(response);
  const bytes = new Uint8Array(await response.arrayBuffer());
  const grey = bits === 16 ? bytes.filter((_, i) => i % 2 === 1) : bytes;  // the upper half of each pixel
  if (grey.length !== width * height) throw new Error("the frame is cut off");
  return {width, height, grey};
}

function imageOf({width, height, grey}) {
  const image = new ImageData(width, height);
  const pixels = new Uint32Array(image.data.buffer);
  for (let i = 0; i < grey.length; ++i) pixels[i] = 0xff000000 | (grey[i] * 0x10101);
  return image;
}

function fitCanvas(canvas, {width, height}) {
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
}

// Draws a frame of a camera; over it, in red, what is as bright as the sensor can tell, and in green how sharp each part
// is. @return figures of the frame: the part clipped, and the sharpness (below)
async function drawFrame(canvas, frame, {clipping, sharpness}) {
  const {width, height, grey} = frame;
  fitCanvas(canvas, frame);
  const context = canvas.getContext("2d");
  const image = imageOf(frame), data = image.data;
  if (!canvas.dataset.frames) {  // the first is seen before it is judged; later ones would flicker
    context.putImageData(image, 0, 0);
    canvas.dataset.frames = "1";
    await new Promise((done) => setTimeout(done));
  }
  let clipped = 0;
  for (let i = 0, at = 0; i < grey.length; ++i, at += 4) {
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
