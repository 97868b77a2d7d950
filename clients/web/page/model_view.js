// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// The view "Model": slsd-model on the scanner follows an object that turns, and fuses its clouds into a mesh. Every browser
// sees the same session.
const kModelPause = 400, kModelIdlePause = 2000;  // ms
const kSeenAround = 15;  // degrees to either side that a view shows
const kMostMessages = 20;
const kFormatNames = {stl: "STL", "3mf": "3MF", glb: "GLB", obj: "OBJ", ply: "PLY with sigmas"};
let modelTold = null, modelText = "", modelView = null, modelPreview = 0, modelHandled = false, modelReplaceUntil = 0;

const modelRuns = () => modelTold !== null && ["following", "building"].includes(modelTold.state);

// ---- what is missing ----

function sidesInWords({seen_degrees: seen, missing_from_degrees: from, missing_degrees: missing, seen_from_all_sides: all}) {
  if (all) return "Seen from all sides.";
  if (seen <= 0) return "Seen from one side: turn the object.";
  return `Seen ${seen.toFixed(0)}° of 360°. Missing: ${from.toFixed(0)}° to ${(from + missing).toFixed(0)}° after the first view.`;
}

// From above: the first view below, the others as they follow in the direction of the turn; green was seen, the white mark
// is the latest.
function drawRing(progress) {
  const ring = $("model-ring"), context = ring.getContext("2d"), {width, height} = ring;
  const [x, y, radius] = [width / 2, height / 2, width / 2 - 22];
  const angle = (degrees) => (degrees + 90) * Math.PI / 180;
  const arc = (from, to, colour, wide) => {
    context.beginPath();
    context.arc(x, y, radius, angle(from), angle(to));
    [context.strokeStyle, context.lineWidth] = [colour, wide];
    context.stroke();
  };
  context.clearRect(0, 0, width, height);
  arc(0, 360, "#16181c", 36);
  arc(0, 360, "#ff8a80", 20);
  const views = progress.views_degrees.length > 0 ? progress.views_degrees : [0];
  for (const view of views) arc(view - kSeenAround, view + kSeenAround, "#5fd38d", 24);
  const latest = views[views.length - 1];
  arc(latest - 2, latest + 2, "#fff", 36);
  context.font = "bold 40px system-ui, sans-serif";
  [context.fillStyle, context.textAlign, context.textBaseline] = ["#e8eaed", "center", "middle"];
  context.fillText(`${Math.round(progress.seen_from_all_sides ? 360 : progress.seen_degrees)}°`, x, y);
  ring.setAttribute("aria-label", sidesInWords(progress));
}

// ---- the state ----

// The program's words for a terminal, in those of the page.
const modelWords = (sentence) => sentence.replace("press Enter", "press “Next view”").replace("; Ctrl-C ends, and writes the model", "");

function modelState({state, progress, building, choices, report, kept_clouds: kept}) {
  if (state === "following") {
    const clouds = progress ? `${countOf(progress.placed, "cloud")}. ` : "";
    const view = choices.turntable && progress ? `View ${progress.placed} of ${choices.views}. ` : clouds;
    return ["", progress ? view + sidesInWords(progress) : "Waiting for the first cloud…"];
  }
  if (state === "building") {
    if (!building) return ["", progress ? `Reading ${progress.clouds} of ${countOf(kept, "cloud")}…` : "Reading the clouds…"];
    if (building.of === 0) return ["", "Adjusting all places…"];
    return ["", building.fused < building.of ? `Fusing cloud ${building.fused + 1} of ${building.of}…` : "Meshing, writing the files…"];
  }
  if (state === "done") return ["good", "The model is ready ✓"];
  if (state === "failed") return ["bad", report ? "The new build failed. The previous model is kept." : "There is no model."];
  if (state === "cut") return ["wait", `The last session was interrupted. ${countOf(kept, "cloud")} are kept: build a model from them.`];
  return ["", ""];
}

function reportInWords(report, state) {
  const lines = state === "done" ? [] : ["Previous model:"];
  lines.push(`${report.fused} of ${countOf(report.frames, "cloud")} fused; the object turned by ${report.turned_degrees.toFixed(0)}°.`,
             `${report.triangles.toLocaleString("en")} triangles, voxels of ${report.voxel_mm.toFixed(2)} mm, median sigma ${report.sigma_mm.toFixed(3)} mm.`,
             report.closed ? `The end meets the beginning: ${report.drift_mm.toFixed(2)} mm apart before, ${report.seam_mm.toFixed(2)} mm after the adjustment.`
                           : "The end does not meet the beginning: not all sides were seen.");
  if (report.invented_share > 0) lines.push(`${(100 * report.invented_share).toFixed(1)} % of the surface is invented, to close the holes.`);
  for (const {frame, reason} of report.refused) lines.push(`${frame} was left out: ${reason}`);
  return lines.join("\n");
}

function showFormats(formats) {
  const names = Object.keys(kFormatNames).filter((name) => formats[name]), shown = [...$("model-format").options];
  const words = names.map((name) => `${kFormatNames[name]}, ${inMegabytes(formats[name])} MB`);
  if (shown.map((option) => option.textContent).join("\n") === words.join("\n")) return;
  const before = $("model-format").value;
  $("model-format").replaceChildren(...names.map((name, i) => Object.assign(element("option", words[i]), {value: name})));
  if (names.includes(before)) $("model-format").value = before;
}

function showModelButtons({state, installed, choices, formats, has_background: background, kept_clouds: kept}) {
  const runs = modelRuns();
  $("model-install").hidden = installed;
  $("model-choices").hidden = runs;
  allow($("model-start"), installed && !runs);
  allow($("model-next"), state === "following" && Boolean(choices.turntable));
  $("model-next").hidden = $("model-turned").value !== "table" && !(runs && choices.turntable);
  allow($("model-stop"), state === "following");
  allow($("model-build"), installed && !runs && kept > 0);
  allow($("model-clear"), runs || kept > 0 || state !== "none");
  allow($("model-empty"), !runs);
  $("model-background").disabled = !background;
  $("model-empty").textContent = background ? "Take the empty scene again" : "Take the empty scene";
  $("model-download").hidden = Object.keys(formats).length === 0;
  $("model-format").disabled = Object.keys(formats).length === 0;
  allow($("model-save"), Object.keys(formats).length > 0);
}

function showModel(told) {
  const text = JSON.stringify(told);
  if (text === modelText) return;
  const before = modelTold;
  [modelTold, modelText] = [told, text];
  const {state, progress, building, report, error, messages} = told;
  [$("model-state").className, $("model-state").textContent] = modelState(told);
  showModelButtons(told);
  showFormats(told.formats);
  $("model-progress").hidden = state !== "building";
  if (building && building.of > 0) $("model-progress").value = building.fused / building.of;
  else $("model-progress").removeAttribute("value");
  const problem = error ? modelWords(error.message) : state === "following" && progress && progress.left_out ?
    `This cloud was left out: ${progress.left_out}` : "";
  [$("model-problem").hidden, $("model-problem").textContent] = [!problem, problem];
  $("model-figures").textContent = report ? reportInWords(report, state) : "";
  $("model-log").hidden = messages.length === 0;
  $("model-log").lastChild.replaceChildren(...messages.slice(-kMostMessages).reverse().map((message) => element("li", modelWords(message))));
  $("model-shown").hidden = told.previews === 0;
  $("model-ring").hidden = !progress;
  if (progress) drawRing(progress);
  if (before && before.state !== state && state === "following") modelHandled = false;
  if (told.previews === 0) [modelPreview, modelHandled] = [0, false];
}

// ---- the surface so far ----

function paintModel() {
  if (!modelView || !modelView.ply) return;
  const colour = $("model-colour");
  for (const [value, field] of [["sigma_mm", "sigma_mm"], ["own", "red"]]) {
    const has = Boolean(modelView.ply.fields[field]), option = colour.querySelector(`[value=${value}]`);
    if (value === "own" && has && option.disabled && colour.value === "plain") colour.value = "own";  // once, when it comes
    option.disabled = !has;
    if (!has && colour.value === value) colour.value = "plain";
  }
  modelView.colour = colour.value;
  modelView.paint();
  if (["plain", "own"].includes(colour.value)) $("model-scale").replaceChildren();
  else showColourBar($("model-scale"), modelView.range, false, colour.value === "frames" ? "clouds; the mesh has what two or more show" : "mm of sigma");
}

// Made when it is first needed: three.js is loaded after the rest.
function spaceOfModel() {
  if (modelView || typeof THREE === "undefined" || !THREE.OrbitControls) return modelView;
  modelView = new CloudView($("model-space"), (lost) => { $("model-lost").hidden = !lost; });
  modelView.colour = $("model-colour").value;
  $("model-space").addEventListener("pointerdown", () => { modelHandled = true; });
  $("model-space").addEventListener("wheel", () => { modelHandled = true; }, {passive: true});
  return modelView;
}

async function drawModel() {
  if (modelTold.previews === modelPreview || modelTold.previews === 0 || !spaceOfModel()) return;
  const response = await ask("api/model/preview"), buffer = await response.arrayBuffer();
  modelPreview = aboutOf(response).number;
  if (!modelHandled) modelView.framed = false;  // until it is turned by hand, all of it is seen
  modelView.show(readCloud(buffer));
  paintModel();
}

// ---- what is done ----

function modelChoices() {
  const made = {close: $("model-close").checked};
  if ($("model-background").checked && !$("model-background").disabled) made.use_background = true;
  if (isBox(boxChosen)) made.box = boxChosen;
  return made;
}

function wayOfTurning() {
  const way = $("model-turned").value;
  if (way !== "table") return {until_closed: way === "closed"};
  return {turntable: true, views: Number($("model-views").value), ...($("model-tinted").checked ? {colour: true} : {})};
}

async function actOnModel(action, choices = {}) {
  showModel(await (await ask("api/model/act", {action, ...choices})).json());
}

// What would be deleted asks once more.
async function startModel() {
  const button = $("model-start");
  if (modelTold.kept_clouds > 0 && Date.now() >= modelReplaceUntil) {
    modelReplaceUntil = Date.now() + kSureFor;
    button.textContent = "Replace the model?";
    setTimeout(() => { if (Date.now() >= modelReplaceUntil) button.textContent = "Start"; }, kSureFor);
    return;
  }
  modelReplaceUntil = 0;
  button.textContent = "Start";
  await actOnModel("start", {...wayOfTurning(), ...modelChoices()});
}

async function followModel() {
  for (;; await pause(modelRuns() ? kModelPause : kModelIdlePause)) {
    if (document.hidden || !isShown("model")) continue;
    try {
      showModel(await askState("api/model"));
      await drawModel();
      say("model", null);
    } catch (error) {
      say("model", error);
    }
  }
}

function showWayOfTurning() {
  $("model-views-label").hidden = $("model-tinted-label").hidden = $("model-turned").value !== "table";
  if (modelTold) showModelButtons(modelTold);
  else $("model-next").hidden = true;
}

function beginModel() {
  onClick($("model-start"), startModel);
  onClick($("model-next"), () => actOnModel("next"));
  onClick($("model-stop"), () => actOnModel("stop"));
  onClick($("model-build"), () => actOnModel("build", modelChoices()));
  onSecondPress($("model-clear"), () => modelRuns() && !modelTold.report ? "End without a model?" : "Delete the model?", () => actOnModel("clear"));
  onClick($("model-empty"), async () => {
    showModel(await (await ask("api/model/background", {})).json());
    $("model-background").checked = true;
  });
  onClick($("model-save"), async () => {
    const format = $("model-format").value;
    saveAs(await (await ask("api/model/file?format=" + format)).blob(), "model." + format);
  });
  onClick($("model-whole"), async () => {
    modelHandled = false;
    if (modelView) modelView.frameAll();
  });
  onClick($("model-draw-again"), async () => modelView.drawAgain());
  $("model-colour").addEventListener("change", paintModel);
  $("model-turned").addEventListener("change", showWayOfTurning);
  showWayOfTurning();
  followModel();
}
