// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// The colours of slsctl's --cloud-picture: gold is low or near, indigo high or far. Lightness falls steadily, so the scale
// is readable without colour.
const kStops = [[252, 216, 104], [204, 212, 102], [124, 198, 126], [64, 174, 152], [52, 146, 176], [72, 116, 182], [92, 84, 166]];

function depthColour(share) {
  const place = Math.max(0, Math.min(1, share)) * (kStops.length - 1), stop = Math.min(Math.floor(place), kStops.length - 2);
  return kStops[stop].map((value, i) => Math.round(value + (kStops[stop + 1][i] - value) * (place - stop)));
}

const greyColour = (share) => Array(3).fill(Math.round(255 * (0.08 + 0.92 * Math.max(0, Math.min(1, share)))));

// 256 colours as pixels of a canvas.
function colourTable(grey) {
  const table = new Uint32Array(256);
  const bytes = new Uint8ClampedArray(table.buffer);
  for (let i = 0; i < 256; ++i) bytes.set([...(grey ? greyColour : depthColour)(i / 255), 255], 4 * i);
  return table;
}

// Where most of the values are: from so small a part of them to so large a one. @param first, stride  which of them
function rangeOf(values, first = 0, stride = 1) {
  const step = stride * Math.max(1, Math.floor(values.length / stride / 20000));
  const some = [];
  for (let i = first; i < values.length; i += step) if (!Number.isNaN(values[i])) some.push(values[i]);
  some.sort((a, b) => a - b);
  if (some.length === 0) return [0, 1];
  const low = some[Math.floor(0.01 * (some.length - 1))], high = some[Math.ceil(0.99 * (some.length - 1))];
  return high > low ? [low, high] : [low, low + 1];
}

// The smallest step of 1, 2 or 5 times a power of ten with at most so many steps in the span.
function tickStep(span, most) {
  const power = 10 ** Math.floor(Math.log10(span / most));
  return ([1, 2, 5].find((factor) => factor * power * most >= span) || 10) * power;
}

function ticksOf(low, high, step) {
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({length: Math.max(0, last - first + 1)}, (_, i) => (first + i) * step);
}

const tickLabel = (value, step) => (value === 0 ? 0 : value).toFixed(step >= 1 ? 0 : Math.ceil(-Math.log10(step) - 1e-9));

const kBarTicks = 5;

// A bar of the colours with numbers below it.
function showColourBar(place, [low, high], grey, unit) {
  const bar = document.createElement("canvas"), numbers = element("div", "", "ticks");
  [bar.width, bar.height] = [256, 1];
  const context = bar.getContext("2d"), image = new ImageData(256, 1);
  new Uint32Array(image.data.buffer).set(colourTable(grey));
  context.putImageData(image, 0, 0);
  const step = tickStep(high - low, kBarTicks);
  for (const value of ticksOf(low, high, step)) {
    const number = element("span", tickLabel(value, step)), share = (value - low) / (high - low);
    number.style.left = `${100 * share}%`;
    number.style.transform = `translateX(${-100 * share}%)`;
    numbers.append(number);
  }
  place.replaceChildren(bar, numbers, element("span", unit, "unit"));
}
