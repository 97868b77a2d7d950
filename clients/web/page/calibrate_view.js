// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

const kBusyPause = 400, kIdlePause = 2000;
const kMany = 20;  // points in a cell of the coverage

const kSessionStates = {
  "starting": "Starting…",
  "no board": "No board in view",
  "moving": "Hold it still",
  "still": "Still…",
  "hold": "HOLD",
  "taken": "TAKEN ✓",
  "again": "Not taken",
  "done": "Now another pose",
  "computing": "Computing…",
  "in force": "Calibrated and in force",
  "ended": "Not calibrated"};

// Where points were seen so far: red where none was, yellow where few, green where many.
function drawCoverage(context, coverage) {
  const {width, height} = context.canvas;
  const wide = width / coverage.columns, high = height / coverage.rows;
  coverage.counts.forEach((count, i) => {
    context.fillStyle = count === 0 ? "rgba(220, 40, 40, .22)" : count < kMany ? "rgba(230, 180, 0, .28)" : "rgba(30, 180, 70, .3)";
    context.fillRect((i % coverage.columns) * wide + 1, Math.floor(i / coverage.columns) * high + 1, wide - 2, high - 2);
  });
}

function coveredShare(coverage) {
  return coverage.counts.filter((count) => count > 0).length / coverage.counts.length;
}

function figureOf(name, width, height, holder = $("calibrate-pictures")) {
  const present = [...holder.children].find((figure) => figure.dataset.name === name);
  if (present) return present;
  const figure = document.createElement("figure");
  figure.dataset.name = name;
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  figure.append(canvas, document.createElement("figcaption"));
  holder.append(figure);
  return figure;
}

async function drawCamera(camera, moves) {
  const frame = await askFrame(camera.name);
  const figure = figureOf("camera " + camera.name, frame.width, frame.height);
  const canvas = figure.firstChild, context = canvas.getContext("2d");
  fitCanvas(canvas, frame);
  context.putImageData(imageOf(frame), 0, 0);
  drawCoverage(context, camera.coverage);
  context.fillStyle = "#3df06b";
  for (const [x, y] of moves ? [] : camera.points) {
    context.beginPath();
    context.arc(x, y, canvas.width / 250, 0, 7);
    context.fill();
  }
  figure.lastChild.textContent = `camera ${camera.name}: ${Math.round(100 * coveredShare(camera.coverage))} % covered` +
    (camera.unseen ? `; ${camera.unseen}` : "");
}

function drawProjector(coverage) {
  const figure = figureOf("projector", 320, 200);
  const context = figure.firstChild.getContext("2d");
  context.fillStyle = "#333";
  context.fillRect(0, 0, 320, 200);
  drawCoverage(context, coverage);
  figure.lastChild.textContent = `the projector's light: ${Math.round(100 * coveredShare(coverage))} % covered`;
}

function showVerdict({outcome, error, under_way}) {
  const lines = [];
  if (error) lines.push(element("p", error, "bad"));
  if (outcome) {
    lines.push(element("p", `The calibration is ${outcome.grade}.`, {good: "good", usable: "wait"}[outcome.grade] || "bad"));
    for (const reason of outcome.reasons) lines.push(element("p", reason));
    for (const warning of outcome.warnings) lines.push(element("p", warning, "wait"));
    for (const advice of outcome.advice) lines.push(element("p", "Next time: " + advice));
    lines.push(element("p", `RMS error: ${outcome.camera_rms_px.toFixed(3)} px in the camera, ${outcome.projector_rms_px.toFixed(3)} px ` +
      `in the projector, ${outcome.epipolar_rms_px.toFixed(3)} px off the epipolar lines.`));
  }
  $("verdict").replaceChildren(...(under_way ? [] : lines));
}

function showSession(told) {
  const progress = told.progress || {};
  $("calibrate-start").hidden = told.under_way;
  $("calibrate-stop").hidden = !told.under_way;
  $("calibrate-state").textContent = kSessionStates[progress.state] || progress.state || "";
  $("calibrate-state").className = ["taken", "in force"].includes(progress.state) ? "good" :
    ["again", "ended"].includes(progress.state) ? "bad" : progress.state === "hold" ? "wait" : "";
  $("calibrate-next").textContent = progress.wanted === undefined ? "" :
    `${progress.poses} of ${progress.wanted} poses.` +
    (told.under_way ? ` ${progress.text ? progress.text + ". " : ""}Next: ${progress.next}.` : "");
  showVerdict(told);
  $("calibrate-log").hidden = told.log.length === 0;
  $("calibrate-log").lastChild.textContent = told.log.join("\n");
}

async function calibrate(body) {
  showSession(await (await ask("api/calibrate", body)).json());
}

async function followCalibration() {
  let number = -1, wasUnderWay = false;
  for (;; await pause(wasUnderWay ? kBusyPause : kIdlePause)) {
    if (document.hidden || !(isShown("calibrate") || wasUnderWay) || !mayAdminister) continue;
    try {
      const told = await askState("api/calibration");
      if (told.number !== number) showSession(told);
      number = told.number;
      wasUnderWay = told.under_way;
      say("calibration", null);
      if (!told.under_way || !told.progress.cameras) continue;
      const moves = ["taken", "again"].includes(told.progress.state);  // the board, away from where it was
      for (const camera of told.progress.cameras) await drawCamera(camera, moves);
      drawProjector(told.progress.projector.coverage);
    } catch (error) {
      say("calibration", error);
      await pause(kRetryPause);
    }
  }
}

function beginCalibrating() {
  onClick($("calibrate-begin"), async () => {
    $("calibrate-pictures").replaceChildren();
    const body = {action: "begin", poses: Number($("poses").value), resume: $("resume").checked};
    for (const name of ["board", "ruler"]) if ($(name).value.trim()) body[name] = $(name).value.trim();
    await calibrate(body);
  });
  onClick($("calibrate-end"), () => calibrate({action: "end"}));
  onClick($("calibrate-cancel"), () => calibrate({action: "cancel"}));
  followCalibration();
}
