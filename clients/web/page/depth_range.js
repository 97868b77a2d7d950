// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// Two sliders: only what lies between them is shown, and has the whole bar of colours. At the ends they leave out nothing.
const kSliderSteps = 1000;
let depthsOfCloud = null;  // of the cloud that is shown, nearly all, mm
let depthLimits = null;    // what was chosen, mm; null: all

function showDepthLimits() {
  const [low, high] = depthsOfCloud || [0, 1], [near, far] = depthLimits || [low, high];
  const step = (value) => Math.round(kSliderSteps * Math.max(0, Math.min(1, (value - low) / (high - low))));
  for (const id of ["near", "far", "all-depths"]) $(id).disabled = !depthsOfCloud;
  [$("near").value, $("far").value] = [step(near), step(far)];
  $("near-mm").textContent = depthsOfCloud ? `${near.toFixed(1)} mm` : "";
  $("far-mm").textContent = depthsOfCloud ? `${far.toFixed(1)} mm` : "";
}

// With a margin, so that the sliders' ends lie outside of every point but strays.
function offerDepths(ply) {
  const [low, high] = ply.count > 0 ? rangeOfField(ply, "z") : [0, 1], margin = 0.1 * (high - low);
  depthsOfCloud = ply.count > 0 ? [low - margin, high + margin] : null;
  showDepthLimits();
}

function limitDepths(moved) {
  const [low, high] = depthsOfCloud, value = (id) => low + (high - low) * Number($(id).value) / kSliderSteps;
  const other = moved === "near" ? "far" : "near";
  if (Number($("near").value) >= Number($("far").value))
    $(other).value = Number($(moved).value) + (moved === "near" ? 1 : -1);
  const all = Number($("near").value) <= 0 && Number($("far").value) >= kSliderSteps;
  depthLimits = all ? null : [value("near"), Math.max(value("far"), value("near") + (high - low) / kSliderSteps)];
  showDepthLimits();
  paintLimits();
}

function paintLimits() {
  view.limits = depthLimits;
  view.paint();
  drawShown();
}

function beginDepthRange() {
  for (const id of ["near", "far"]) {
    $(id).max = kSliderSteps;
    $(id).addEventListener("input", () => limitDepths(id));
  }
  onClick($("all-depths"), async () => {
    depthLimits = null;
    showDepthLimits();
    paintLimits();
  });
  showDepthLimits();
}
