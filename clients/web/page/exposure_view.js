// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

const kProposals = 3;  // clipped symbols hide how bright they are: the first proposal may be rough

const adviseExposure = async (camera) => (await ask("api/exposure?camera=" + encodeURIComponent(camera))).json();

async function setCamera(camera, set) {
  const told = await (await ask("api/set", {camera: {[camera]: set}})).json();
  return told.not_kept ? ` Not saved for the next start: ${told.not_kept}` : "";
}

const settingInWords = (set) => Object.entries(set).map(([key, value]) => `${key} = ${value}`).join(", ");

// What the proposal would set; the gain only where it is to be another.
function settingOf({present, proposed}) {
  const set = {exposure_us: Math.round(proposed.exposure_us)};
  if (Math.abs(proposed.gain_db - present.gain_db) > 0.05) set.gain_db = Math.round(10 * proposed.gain_db) / 10;
  return set;
}

function takeExposure(camera, told) {
  const button = element("button", "Use this exposure");
  button.id = "take-exposure";
  onClick(button, async () => {
    const set = settingOf(told), problem = await setCamera(camera, set);
    $("exposure").replaceChildren(element("p", `Set: ${settingInWords(set)}.${problem}`, "good"));
    await takePicture();
  });
  return button;
}

function lightInWords(told) {
  if (told.patterned_share === 0) return "The frame shows no pattern.";
  return `Symbols reach ${Math.round(told.lit)} of ${told.full}; the pattern covers ${Math.round(100 * told.patterned_share)} % ` +
    `of the frame, ${Math.round(100 * told.clipped_share)} % of that is clipped.`;
}

function brightnessInWords(told) {
  return told.brighter === 1 ? "The brightness is good as it is." :
    `${told.brighter.toPrecision(2)} times as much light would be best.`;
}

const troublesOf = (told) => told.troubles.map((trouble) => element("p", trouble.remedy, "wait"));

async function proposeExposure() {
  $("exposure").replaceChildren(element("p", "Taking two frames…"));
  try {
    const camera = $("which-camera").value, told = await adviseExposure(camera);
    const lines = [element("p", lightInWords(told))];
    if (told.proposed && told.present)
      lines.push(element("p", `Set exposure_us = ${Math.round(told.proposed.exposure_us)} and a gain of ` +
        `${told.proposed.gain_db.toFixed(1)} dB; now they are ${Math.round(told.present.exposure_us)} and ` +
        `${told.present.gain_db.toFixed(1)} dB.`), takeExposure(camera, told));
    else if (told.patterned_share > 0)
      lines.push(element("p", brightnessInWords(told)));
    $("exposure").replaceChildren(...lines, ...troublesOf(told));
  } catch (error) {
    $("exposure").replaceChildren();
    throw error;
  }
}

// Proposes and sets in one. What was set before can be had back.
async function setBestExposure() {
  const camera = $("which-camera").value;
  let before = null, set = null, problem = "", told;
  try {
    for (let i = 0; i < kProposals; ++i) {
      $("exposure").replaceChildren(element("p", "Taking two frames…"));
      told = await adviseExposure(camera);
      if (!told.proposed || !told.present) break;
      before = before || told.present;
      set = settingOf(told);
      problem = await setCamera(camera, set);
      if (!told.look_again) break;
    }
  } catch (error) {
    $("exposure").replaceChildren();
    throw error;
  }
  const lines = set ? [element("p", `Set: ${settingInWords(set)}.${problem}`, "good"), takeBack(camera, before, set)] :
    [element("p", lightInWords(told)), ...(told.patterned_share > 0 ? [element("p", brightnessInWords(told))] : [])];
  $("exposure").replaceChildren(...lines, ...troublesOf(told));
  await takePicture();
}

function takeBack(camera, before, set) {
  const old = Object.fromEntries(Object.keys(set).map((key) => [key, before[key]]));
  const button = element("button", `Back to ${settingInWords(old)}`);
  button.id = "take-back";
  onClick(button, async () => {
    await setCamera(camera, old);
    $("exposure").replaceChildren(element("p", `Set: ${settingInWords(old)}.`, "good"));
    await takePicture();
  });
  return button;
}

function beginExposure() {
  onClick($("propose"), proposeExposure);
  onClick($("expose"), setBestExposure);
}
