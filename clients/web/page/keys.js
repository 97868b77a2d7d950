// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// Keys, each for what a button does; and the view that takes the whole screen.
const kViews = ["devices", "camera", "cloud", "model", "calibrate", "history"];

function press(id) {
  if (!$(id).disabled) $(id).click();
}

function nextShownAs() {
  $("shown-as").selectedIndex = ($("shown-as").selectedIndex + 1) % $("shown-as").options.length;
  $("shown-as").dispatchEvent(new Event("change"));
}

function go(view) {
  choose(view);
  $(view).scrollIntoView();
}

const kKeys = [
  ["s", "scan", () => press("scan")],
  ["l", "live cloud on and off", () => press("cloud-live")],
  ["v", "live picture on and off", () => press("camera-live")],
  ["e", "set the best exposure", () => press("expose")],
  ["m", "measuring on and off", () => press("measure")],
  ["h", "shading on and off", () => press("shaded")],
  ["x", "clear the distances", () => press("clear-distances")],
  ["t", "in space, or a map", () => nextShownAs()],
  ["w", "fit the cloud to the view", () => press("whole")],
  ["d", "download the cloud as PLY", () => press("save-ply")],
  ["f", "cloud in full screen on and off", () => toggleFull("cloud")],
  ["g", "picture in full screen on and off", () => toggleFull("camera")],
  ...kViews.map((view, i) => [String(i + 1), `go to ${view}`, () => go(view)]),
  ["?", "show these keys", () => toggleHelp()]];

function toggleHelp() {
  if ($("help").open) $("help").close();
  else $("help").showModal();
}

// The whole page goes to full screen and shows one view, so that messages stay visible. Where the browser refuses full
// screen, the view takes the window.
const kScreenPause = 1000;
let screenChanges = Promise.resolve(), leavesScreen = false;

function toggleFull(view) {
  showFull(document.body.dataset.full === view ? null : view);
  screenChanges = screenChanges.then(followFull).catch(() => {});
}

async function followFull() {
  const wanted = Boolean(document.body.dataset.full), root = document.documentElement;
  if (wanted === Boolean(document.fullscreenElement) || !root.requestFullscreen) return;
  leavesScreen = !wanted;
  // The event comes after the promise. Without it, the next change would take it for the browser's own key.
  const changed = new Promise((done) => document.addEventListener("fullscreenchange", done, {once: true}));
  await (wanted ? root.requestFullscreen() : document.exitFullscreen());
  await Promise.race([changed, pause(kScreenPause)]);
}

function showFull(view) {
  if (view) {
    document.body.dataset.full = view;
    choose(view);
  } else {
    delete document.body.dataset.full;
  }
  for (const button of document.querySelectorAll("[data-full-screen]"))
    button.setAttribute("aria-pressed", String(button.dataset.fullScreen === view));
}

function onKey(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing) return;
  const writes = event.target.closest && event.target.closest("input:not([type=checkbox]), select, textarea");
  if (writes || $("login").open || ($("help").open && event.key !== "?")) return;
  if (event.key === "Escape" && document.body.dataset.full) return toggleFull(document.body.dataset.full);
  const found = kKeys.find(([key]) => key === event.key);
  if (!found) return;
  event.preventDefault();
  if (!event.repeat) found[2]();
}

function beginKeys() {
  $("key-list").replaceChildren(...kKeys.map(([key, words]) => {
    const row = element("tr", ""), cell = element("td", "");
    cell.append(element("kbd", key));
    row.append(cell, element("td", words));
    return row;
  }));
  document.addEventListener("keydown", onKey);
  document.addEventListener("fullscreenchange", () => {
    if (!document.fullscreenElement && !leavesScreen) showFull(null);  // by the browser's own key
    leavesScreen = false;
  });
  for (const button of document.querySelectorAll("[data-full-screen]"))
    button.addEventListener("click", () => toggleFull(button.dataset.fullScreen));
  $("show-help").addEventListener("click", toggleHelp);
  $("close-help").addEventListener("click", toggleHelp);
}
