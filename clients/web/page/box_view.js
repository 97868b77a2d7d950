// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// The part of the scene that the next scans measure: a rectangle drawn on a map, as deep as what it holds; or six numbers.
const kBoxFields = ["x-from", "y-from", "z-from", "x-to", "y-to", "z-to"];  // in the order of the service's `box`
const kBoxMargin = 0.05, kLeastMargin = 1;  // of the depth of what was drawn over; mm
const kFewestInBox = 10;
let boxChosen = null;  // of this page's scans, in the rig's frame; null: as the service is set
let partOfService = {box: [], plane: [], box_frame: "rig"};  // of every scan that names none
let drawsBox = false, boxDrawnFrom = null;

const isInBase = () => partOfService.box_frame === "robot_base";
// Box and plane have one frame, so a box drawn here would move such a plane into the rig's frame.
const planeIsInBase = () => isInBase() && partOfService.plane.length > 0;
const boxIsInBase = () => isInBase() && partOfService.box.length > 0;
const boxToDraw = () => boxChosen ?? (boxIsInBase() ? [] : partOfService.box);
const isBox = (box) => box !== null && box.length > 0;
const mayKeepBox = () => mayAdminister && boxChosen !== null && !(isBox(boxChosen) && planeIsInBase());

function boxInWords() {
  if (boxChosen === null) {
    if (boxIsInBase()) return "Every scan measures a box in the robot's base. The page cannot draw it.";
    return isBox(partOfService.box) ? "Every scan measures only this box." : "";
  }
  if (!isBox(boxChosen)) return "The next scans of this page measure the whole scene.";
  return "The next scans of this page measure only this box. Live clouds and other clients still see the rest." +
    (planeIsInBase() ? " The box cannot be kept for every scan: box and plane have one frame, and a plane is configured in " +
                       "the robot's base. Scans of this box leave that plane out." : "");
}

function showBox() {
  const box = boxToDraw();
  kBoxFields.forEach((id, i) => {
    if (document.activeElement !== $(id)) $(id).value = box.length === 6 ? Math.round(10 * box[i]) / 10 : "";
  });
  $("box-note").textContent = boxInWords();
  allow($("box-for-all"), mayKeepBox());
  allow($("box-whole"), isBox(boxChosen ?? partOfService.box));
  $("box-draw").setAttribute("aria-pressed", String(drawsBox));
  if (view) view.drawBox(overlay.box, !isBox(box) ? null : [[box[0], box[3]], [box[1], box[4]], [box[2], box[5]]]);
  if (view && view.ply) view.draw();
}

// The plane is named too, so that the box's frame never becomes that of a plane in the robot's base.
function partOfScan() {
  if (!isBox(boxChosen)) return boxChosen === null ? {} : {box: []};
  return {box: boxChosen, box_frame: "rig", plane: isInBase() ? [] : partOfService.plane};
}

// Another part of the scene is to fill the view.
let boxScanned = "[]";

function boxWasScanned() {
  const scanned = JSON.stringify(boxChosen ?? partOfService.box);
  if (scanned !== boxScanned) view.framed = false;
  boxScanned = scanned;
  say("box", null);
}

function forgetBox() {
  boxChosen = null;
  showBox();
}

function followPart({box = [], plane = [], box_frame = "rig"}) {
  const part = {box, plane, box_frame};
  if (JSON.stringify(part) === JSON.stringify(partOfService)) return;
  partOfService = part;
  showBox();
}

// A preset may have a plane in a frame of its own.
function refuseBesidePreset() {
  if (presetChosen !== null) throw new Error("Scan with the chosen preset first, then choose a box.");
}

// The frame of a configured plane stays as it is.
async function keepBox() {
  const box_frame = isBox(boxChosen) && partOfService.plane.length === 0 ? "rig" : partOfService.box_frame;
  await ask("api/set", {cloud: box_frame === partOfService.box_frame ? {box: boxChosen} : {box: boxChosen, box_frame}});
  partOfService = {...partOfService, box: boxChosen, box_frame};
  forgetBox();
}

function takeFields() {
  const box = kBoxFields.map((id) => $(id).value === "" ? NaN : Number($(id).value));
  if (box.some(Number.isNaN)) return;  // not whole yet
  const wrong = ["x", "y", "z"].filter((_, axis) => box[axis] >= box[axis + 3]);
  try {
    if (wrong.length > 0) throw new Error(`The box's end of ${wrong.join(" and ")} must be greater than its start.`);
    refuseBesidePreset();
    boxChosen = box;
    say("box", null);
  } catch (error) {
    return say("box", error);
  }
  showBox();
}

// Around the points of a rectangle of the map's pixels. @return null where there are too few
function boxAround([left, top], [right, bottom]) {
  const {width, height, at} = map.records, depths = [];
  const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
  const from = new DataView(map.ply.buffer, map.ply.begin), [near, far] = depthLimits || [-Infinity, Infinity];
  const {x, y, z} = map.ply.fields;
  for (let v = Math.max(0, top); v <= Math.min(height - 1, bottom); ++v) {
    for (let u = Math.max(0, left); u <= Math.min(width - 1, right); ++u) {
      const record = at[v * width + u], base = record * map.ply.record;
      if (record < 0) continue;
      const depth = from.getFloat32(base + z.offset, true);
      if (depth < near || depth > far) continue;
      depths.push(depth);
      [x, y].forEach(({offset}, axis) => {
        const value = from.getFloat32(base + offset, true);
        [low[axis], high[axis]] = [Math.min(low[axis], value), Math.max(high[axis], value)];
      });
    }
  }
  if (depths.length < kFewestInBox) return null;
  const [first, last] = rangeOf(depths), margin = Math.max(kLeastMargin, kBoxMargin * (last - first));
  return [...low, first - margin, ...high, last + margin].map((value) => Math.round(10 * value) / 10);
}

function showRubber(a, b) {
  $("rubber").hidden = a === null;
  if (a === null) return;
  const style = $("rubber").style, frame = $("space-frame").getBoundingClientRect(), place = $("map").getBoundingClientRect();
  style.left = `${Math.min(a[0], b[0]) + place.left - frame.left}px`;
  style.top = `${Math.min(a[1], b[1]) + place.top - frame.top}px`;
  style.width = `${Math.abs(b[0] - a[0])}px`;
  style.height = `${Math.abs(b[1] - a[1])}px`;
}

function endDrawing(to) {
  const from = boxDrawnFrom;
  boxDrawnFrom = null;
  drawsBox = false;
  showRubber(null);
  const corners = [0, 1].map((axis) => [from, to].map((place) => map.pixelAt(...place)[axis]).sort((a, b) => a - b));
  const box = map.records && boxAround([corners[0][0], corners[1][0]], [corners[0][1], corners[1][1]]);
  say("box", box ? null : new Error("There are too few points in this rectangle: draw it over a surface."));
  if (box) boxChosen = box;
  showBox();
}

async function beginDrawing() {
  if (drawsBox) {
    drawsBox = false;
    return showBox();
  }
  refuseBesidePreset();
  if (!view || !view.ply) throw new Error("Scan first, then draw a box over what you see.");
  if ($("shown-as").value !== "z") {
    $("shown-as").value = "z";
    drawShown();
  }
  drawsBox = true;
  showBox();
}

function beginBox() {
  onClick($("box-draw"), beginDrawing);
  onClick($("box-whole"), async () => {
    refuseBesidePreset();
    boxChosen = [];
    say("box", null);
    showBox();
  });
  onClick($("box-for-all"), keepBox);
  for (const id of kBoxFields) $(id).addEventListener("change", takeFields);
  const area = $("map");
  area.addEventListener("pointerdown", (event) => {
    if (!drawsBox) return;
    boxDrawnFrom = placeIn(event);
    if (event.isTrusted) area.setPointerCapture(event.pointerId);
  });
  area.addEventListener("pointermove", (event) => {
    if (boxDrawnFrom) showRubber(boxDrawnFrom, placeIn(event));
  });
  area.addEventListener("pointerup", (event) => {
    if (!boxDrawnFrom) return;
    event.stopImmediatePropagation();  // it measures nothing
    endDrawing(placeIn(event));
  });
  area.addEventListener("pointercancel", () => {
    boxDrawnFrom = null;
    showRubber(null);
  });
}
