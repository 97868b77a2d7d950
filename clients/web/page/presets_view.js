// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// Settings by name. A chosen preset comes into force with the next scan, which needs no more rights than the scan itself;
// after that the list shows what is in force, also if another client changed it.
const kPresetsPause = 5000;
let presets = {}, presetInForce = null, presetChosen = null;

function settingsInWords(settings) {
  const words = [];
  for (const [table, keys] of Object.entries(settings)) {
    for (const [key, value] of Object.entries(keys)) {
      if (table === "camera") for (const [name, set] of Object.entries(value)) words.push(`${key}: ${name} = ${set}`);
      else words.push(`${key} = ${value}`);
    }
  }
  return words.length === 0 ? "everything as in the configuration's file" : words.join(", ");
}

// A chosen preset stays, also if another client deleted it: the scan is then refused, instead of measuring by other settings.
function showPresets() {
  const names = [...new Set([...Object.keys(presets), ...(presetChosen === null ? [] : [presetChosen])])].sort(), choice = $("preset");
  if ([...choice.options].slice(1).map((option) => option.value).join("\n") !== names.join("\n"))
    choice.replaceChildren(choice.options[0], ...names.map((name) => Object.assign(element("option", name), {value: name})));
  const shown = presetChosen ?? presetInForce ?? "";
  if (choice.value !== shown) choice.value = shown;
  allow($("preset-delete"), shown !== "" && mayAdminister);
  allow($("preset-save"), mayAdminister);
  $("preset-about").textContent = shown && presetInWords(shown);
}

function presetInWords(name) {
  if (!presets[name]) return `${name} was deleted: choose another preset.`;
  return `${name}: ${settingsInWords(presets[name].settings)}.` +
    (presetChosen !== null && presetChosen !== presetInForce ? " It comes into force with the next scan." : "");
}

async function readPresets() {
  ({presets, in_force: presetInForce} = await askState("api/presets"));
  if (presetChosen === presetInForce) presetChosen = null;
  showPresets();
}

function choosePreset() {
  presetChosen = $("preset").value || null;
  forgetBox();  // a preset has its own
  const {density} = (presets[presetChosen] && presets[presetChosen].settings.decode) || {};
  if (density) {  // else the page would ask for another one
    $("density").value = density;
    $("density").dispatchEvent(new Event("change"));
  }
  showPresets();
}

// What a scan asks for, because a preset was chosen since the last one.
const presetOfScan = () => presetChosen === null ? {} : {preset: presetChosen};

async function presetWasScanned() {
  presetChosen = null;
  await readPresets();
}

async function presetWasRefused() {
  await readPresets();
  if (presetChosen === null || presets[presetChosen]) return;
  presetChosen = null;
  showPresets();
}

async function followPresets() {
  for (;; await pause(kPresetsPause)) {
    if (document.hidden) continue;
    await readPresets().catch(() => {});  // followStatus() says why
  }
}

function beginPresets() {
  $("preset").addEventListener("change", choosePreset);
  onClick($("preset-save"), async () => {
    const name = $("preset-name").value.trim();
    if (!name) throw new Error("Enter a name for the preset, such as part-a.");
    await ask("api/preset", {action: "save", name});
    $("preset-name").value = "";
    presetChosen = null;
    await readPresets();
  });
  onClick($("preset-delete"), async () => {
    await ask("api/preset", {action: "delete", name: $("preset").value});
    presetChosen = null;
    await readPresets();
  });
  followPresets();
}
