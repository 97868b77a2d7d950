// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// The view "Cloud": scans, live clouds, the cloud in space or as a map, what lies under the cursor, distances.
let view = null, map = null, measurements = null, overlay = null;
let shownScan = null;
let clipped = null;  // the frame of the map of clipping, its camera and its scan, once it was asked for
let clippedAsked = false, clippedSince = 0;
const kClippedPause = 1000;  // ms between two frames of live clouds, as each of them costs a cloud

const isLive = () => $("cloud-live").checked;

function showCloud(buffer, about) {
  const changed = shownScan && shownScan.density !== about.density;
  shownScan = about;
  if (!isLive()) clipped = null;
  if (changed || (view.ply && view.ply.count === 0)) view.framed = false;
  const ply = readCloud(buffer);
  offerDepths(ply);
  view.show(ply);
  overlay.box = boxOf(ply);
  showBox();
  offerColours();
  measurements.clear();  // which draws
  if (cursor) askCursor(cursor);
  else $("under-cursor").textContent = "";
  $("cloud-figures").textContent = `${about.points.toLocaleString("en")} points of scan ${about.scan}, ${about.time}` +
    (about.decode_ms !== undefined ? `; decoded in ${about.decode_ms.toFixed(0)} ms` : "") +
    (about.sigma_calibration_mm !== undefined ?
      `; the calibration may shift the whole cloud by ${about.sigma_calibration_mm.toFixed(2)} mm (one standard deviation)` : "") +
    (about.empty !== undefined ? `. No points: ${about.empty}` : "");
  $("save-ply").disabled = false;
  $("save-pcd").disabled = !view.ply.pcd;
  $("save-hint").hidden = Boolean(view.ply.pcd);
}

// A cloud of pixels has no symbols; before there is a cloud, what would be scanned counts.
function offerColours() {
  const none = view && view.ply ? !view.ply.fields.symbol : $("density").value === "pixels";
  const colour = $("colour");
  colour.querySelector("[value=symbol]").disabled = none;
  if (!none || colour.value !== "symbol") return;
  colour.value = "z";
  if (!view) return;
  view.colour = "z";
  view.paint();
}

const kUnits = {z: "mm of depth", intensity: "intensity, of 255", sigma_mm: "mm of sigma", symbol: "number of the symbol",
                own: "mm of depth: press Scan for the colour, which takes one more frame"};

// ---- in space or as a map ----

const isMap = () => $("shown-as").value !== "space";

function drawShown() {
  $("space").hidden = $("space-overlay").hidden = isMap();
  $("map").hidden = !isMap();
  $("colour").disabled = $("shaded").disabled = isMap();
  if ($("shown-as").value !== "clipping") say("clipping", null);
  if (!view || !view.ply) return;
  if (!isMap()) {
    view.drawDistances(measurements);
    if (view.showsOwn()) $("scale").replaceChildren(element("span", "colour of the surface in white light", "unit"));
    else showColourBar($("scale"), view.range, view.colour === "intensity", kUnits[view.colour]);
    return;
  }
  drawMap().then(() => say("map", null), (error) => say("map", error));
}

// A frame for the map of clipping, unless one is under way: live clouds do not wait for it, and none is asked for twice.
async function askClipped() {
  const live = isLive(), camera = $("which-camera").value, scan = shownScan;
  if (clippedAsked || (live && Date.now() < clippedSince + kClippedPause)) return;
  clippedAsked = true;
  try {
    const frame = await askFrame(camera, false);
    if (live || scan === shownScan) clipped = {frame, camera, scan};
    say("clipping", null);
  } catch (error) {
    say("clipping", error);
    return;
  } finally {
    [clippedAsked, clippedSince] = [false, Date.now()];
  }
  drawShown();
}

async function drawMap() {
  const kind = $("shown-as").value, camera = Math.max(0, $("which-camera").selectedIndex);
  if (kind === "clipping") {
    const ofCamera = clipped && clipped.camera === $("which-camera").value;
    if (!ofCamera || clipped.scan !== shownScan) askClipped();
    if (!ofCamera) return;
  }
  const drawn = map.draw(view.ply, camera, sizeOfCamera(camera), kind, clipped && clipped.frame, depthLimits);
  if (!drawn) {
    if (isLive()) return;  // the next cloud has a map
    $("shown-as").value = "space";
    drawShown();
    throw new Error("A live cloud of pixels does not say where its pixels are. Press Scan for a map.");
  }
  map.drawDistances(measurements);
  if (drawn.range) showColourBar($("scale"), drawn.range, false, kUnits[kind]);
  else $("scale").replaceChildren(element("span", `Red: at the sensor's limit, ${(100 * drawn.clipped).toFixed(2)} % of the frame`, "unit"));
}

// ---- under the cursor ----

let cursor = null;  // where it lies in the view
let cursorAsked = false;

function placeIn(event) {
  const place = event.currentTarget.getBoundingClientRect();
  return [event.clientX - place.left, event.clientY - place.top];
}

// The record of the point that is shown there, or -1.
function recordAt(x, y) {
  if (!view || !view.ply) return -1;
  return isMap() ? map.recordAt(map.pixelAt(x, y)) : view.recordAt(x, y);
}

const pointAt = (x, y) => {
  const record = recordAt(x, y);
  return record < 0 ? null : pointOf(view.ply, record);
};

function tellCursor() {
  cursorAsked = false;
  if (!view || !view.ply || !cursor) return;
  const [x, y] = cursor;
  const point = pointAt(x, y), pixel = isMap() ? `px ${map.pixelAt(x, y).join(", ")}: ` : "";
  $("under-cursor").textContent = pixel + (point === null ? "no point here" :
    `x ${point.at[0].toFixed(2)}  y ${point.at[1].toFixed(2)}  z ${point.at[2].toFixed(2)} mm ± ${point.sigma.toFixed(2)} mm`);
}

function followCursor(event) {
  if (event.buttons) return;  // it turns the cloud
  askCursor(placeIn(event));
}

function askCursor(place) {
  cursor = place;
  if (!cursorAsked) requestAnimationFrame(tellCursor);
  cursorAsked = true;
}

function leaveCursor() {
  cursor = null;  // what it said stays, until another cloud comes
}

// ---- scans ----

async function scan() {
  const preset = presetOfScan();
  const density = $("density").value, colour = $("colour").value === "own" ? {colour: true} : {};
  const {buffer, about} = await askWithProgress("api/scan", {density, ...preset, ...partOfScan(), ...colour}, density)
    .catch(async (error) => {
      if (preset.preset) await presetWasRefused().catch(() => {});  // the scan's own error says more
      throw error;
    });
  boxWasScanned();
  showCloud(buffer, about);
  if (preset.preset) await presetWasScanned();
}

// A map of pixels needs their places, which make a cloud larger.
const kindOfLive = () => "density=" + $("density").value + ($("density").value === "pixels" && isMap() ? "&organised=1" : "");

async function followCloud() {
  let after = 0, kind = null;
  for (;;) {
    if (!isLive() || document.hidden) {
      await pause(50);
      continue;
    }
    if (kind !== kindOfLive()) [kind, after] = [kindOfLive(), 0];
    try {
      const response = await ask(`api/cloud?${kind}&after=${after}`);
      if (response.status === 204) continue;
      const buffer = await response.arrayBuffer();
      const about = aboutOf(response);
      after = about.number;
      if (isLive() && kind === kindOfLive()) showCloud(buffer, about);
      say("cloud", null);
      await new Promise((done) => requestAnimationFrame(done));
    } catch (error) {
      say("cloud", error);
      await pause(kRetryPause);
    }
  }
}

// ---- the whole ----

function beginCloud() {
  onClick($("scan"), scan);
  onClick($("draw-again"), async () => view.drawAgain());
  onClick($("whole"), async () => view && view.frameAll());
  onClick($("save-ply"), async () => saveAs(new Blob([view.ply.buffer]), shownScan.scan + ".ply"));
  onClick($("save-pcd"), async () => saveAs(new Blob(view.ply.pcd()), shownScan.scan + ".pcd"));
  onClick($("clear-distances"), async () => measurements.clear());
  $("save-ply").disabled = $("save-pcd").disabled = true;
  $("cloud-live").addEventListener("change", () => {
    say("cloud", null);
    drawShown();
  });
  $("colour").addEventListener("change", () => {
    if (view) view.colour = $("colour").value;
    if (view && view.paint()) drawShown();
  });
  $("shaded").addEventListener("change", () => {
    if (view) view.shaded = $("shaded").checked;
    if (view && view.paint()) drawShown();
  });
  beginDepthRange();
  for (const id of ["shown-as", "which-camera"]) $(id).addEventListener("change", drawShown);
  $("density").addEventListener("change", () => {
    densityChosen = true;
    offerColours();
  });
  measurements = new Measurements($("distances"), $("distance"), () => view && view.ply && drawShown());
  map = new MapView($("map"));
  beginBox();  // before: what draws a box measures nothing
  for (const place of [$("space"), $("map")]) beginPointing(place);
  $("scan").disabled = $("cloud-live").disabled = true;  // until there is something to draw clouds with
}

function beginPointing(place) {
  let pressed = null;
  place.addEventListener("pointermove", followCursor);
  place.addEventListener("pointerleave", leaveCursor);
  place.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
  place.addEventListener("pointerup", (event) => {
    const moved = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]);
    if (view && $("measure").checked && moved !== null && moved < 5) measurements.add(pointAt(...placeIn(event)));
  });
}

function load(script) {
  return new Promise((done, failed) => {
    const element = Object.assign(document.createElement("script"), {src: script, onload: done});
    element.onerror = () => failed(new Error("three.js was not found on the scanner: install the package libjs-three."));
    document.head.append(element);
  });
}

// After the rest, as it is large: the picture and the states do not wait for it.
async function prepareCloud() {
  try {
    await load("three.js");
    await load("orbit_controls.js");
    view = new CloudView($("space"), (lost) => { $("lost").hidden = !lost; });
    overlay = new SpaceOverlay($("space-overlay"), view);
    overlay.measurements = measurements;
    view.onDrawn = () => overlay.draw();
    new ResizeObserver(() => overlay.resize()).observe($("space"));
    $("scan").disabled = $("cloud-live").disabled = false;
    followCloud();
  } catch (error) {
    $("cloud-figures").textContent = "Clouds cannot be drawn: " + error.message;
  }
}
