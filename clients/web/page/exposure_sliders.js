// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// Exposure and gain of the chosen camera: what is in force, until a hand moves them; then what the hand says is set.
const kShortest = 10, kLongest = 1e6, kExposureSteps = 1000;  // µs
let camerasSet = [];  // of the service's settings
let moving = null;    // "exposure_us" or "gain_db" while a hand moves it or the service takes it
let nextSetting = null, setting = false;

const exposureOfStep = (step) => {
  const exact = kShortest * (kLongest / kShortest) ** (step / kExposureSteps), digits = 10 ** Math.floor(Math.log10(exact) - 2);
  return Math.round(Math.round(exact / digits) * digits * 10) / 10;
};
const stepOfExposure = (us) => kExposureSteps * Math.log(us / kShortest) / Math.log(kLongest / kShortest);

const kSliders = {
  exposure_us: {slider: "exposure-slider", number: "exposure-us", fromSlider: exposureOfStep, toSlider: stepOfExposure},
  gain_db: {slider: "gain-slider", number: "gain-db", fromSlider: (step) => step / 10, toSlider: (db) => 10 * db}};

const chosenCamera = () => camerasSet.find((camera) => camera.name === $("which-camera").value);

function whyFixed(camera) {
  if (!camera) return "";
  if (camera.driver === "file") return "This camera plays back images, so it has no exposure.";
  if (camera.exposures_us && camera.exposures_us.length > 1) return "This camera takes two exposures: change exposures_us in slsd.toml.";
  return mayAdminister ? "" : "slsd-web may not administer this scanner; docs/page.md says how to allow it.";
}

function showSettings(cameras) {
  camerasSet = cameras;
  const camera = chosenCamera(), fixed = whyFixed(camera);
  $("exposure-note").textContent = fixed;
  for (const [key, {slider, number, toSlider}] of Object.entries(kSliders)) {
    $(slider).disabled = $(number).disabled = !camera || fixed !== "";
    if (moving || document.activeElement === $(number)) continue;
    const value = camera && camera[key] !== undefined ? camera[key] : null;
    $(number).value = value === null ? "" : Math.round(10 * value) / 10;
    if (value !== null && Math.round(Number($(slider).value)) !== Math.round(toSlider(value))) $(slider).value = toSlider(value);
  }
}

// Only the newest of what was asked for meanwhile is set.
async function setNewest() {
  if (setting) return;
  setting = true;
  try {
    while (nextSetting) {
      const {camera, set} = nextSetting;
      nextSetting = null;
      const problem = await setCamera(camera, set);
      $("exposure").replaceChildren(element("p", `Set: ${settingInWords(set)}.${problem}`, "good"));
      const known = camerasSet.find(({name}) => name === camera);
      if (known) Object.assign(known, set);
      await showPicture();
    }
    say("settings", null);
  } catch (error) {
    say("settings", error);
  }
  setting = false;
  moving = null;
  showSettings(camerasSet);
}

function changeSetting(key, value) {
  if (!Number.isFinite(value) || $("which-camera").value === "") {
    moving = null;
    return;
  }
  moving = key;
  nextSetting = {camera: $("which-camera").value, set: {[key]: value}};
  setNewest();
}

function beginSliders() {
  $("exposure-slider").max = kExposureSteps;
  for (const [key, {slider, number, fromSlider, toSlider}] of Object.entries(kSliders)) {
    $(slider).addEventListener("input", () => {
      moving = key;
      $(number).value = fromSlider(Number($(slider).value));
    });
    $(slider).addEventListener("change", () => changeSetting(key, fromSlider(Number($(slider).value))));
    $(number).addEventListener("change", () => {
      const value = $(number).value === "" ? NaN : Number($(number).value);
      if (Number.isFinite(value) && value > 0) $(slider).value = toSlider(value);
      changeSetting(key, value);
    });
  }
  $("which-camera").addEventListener("change", () => showSettings(camerasSet));
}
