// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

const $ = (id) => document.getElementById(id);
const countOf = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;
const kStatusPause = 1000, kRetryPause = 1500, kStatusTimeout = 6000, kTimeout = 100000;

// ---- what is asked for ----

class Refused extends Error {
  constructor(status, error) {
    super(error.message);
    this.status = status;
    this.name = error.name;
  }
}

// The half of the session that no other port of this machine is sent; of several scanners below one name, each has its own.
const kKeyName = "slsd_key " + location.pathname;
let keyOfThisTab = "";

function keepKey(key) {
  keyOfThisTab = key;
  try {
    localStorage.setItem(kKeyName, key);
  } catch (error) {
    // Storage is forbidden here: this tab alone keeps it.
  }
}

function sessionKey() {
  try {
    return localStorage.getItem(kKeyName) || keyOfThisTab;
  } catch (error) {
    return keyOfThisTab;
  }
}

// How many changes this page has asked for.
let changes = 0;

const noAnswer = () => new Refused(0, {name: "no_page_service", message: "slsd-web does not answer: check that it is running"});

// Names are relative: the page may lie below any path of a proxy.
async function ask(path, body, timeout = kTimeout) {
  const ends = new AbortController(), timer = setTimeout(() => ends.abort(), timeout);
  try {
    const response = await fetch(path, {
      method: body === undefined ? "GET" : "POST", headers: {"X-Slsd-Page": sessionKey()}, credentials: "same-origin",
      cache: "no-store", signal: ends.signal, body: body === undefined ? undefined : JSON.stringify(body)})
      .catch(() => { throw noAnswer(); });
    if (response.ok) return response;
    const told = await response.json().catch(() => ({}));
    const refused = new Refused(response.status, told.error || {name: "error", message: "HTTP " + response.status});
    if (refused.name === "no_token" && !$("login").open) $("login").showModal();
    throw refused;
  } finally {
    clearTimeout(timer);
    if (body !== undefined) ++changes;
  }
}

// What the page follows. An answer that a change overtook is asked for again: it may tell what was before.
async function askState(path, timeout) {
  for (;;) {
    const before = changes, told = await (await ask(path, undefined, timeout)).json();
    if (changes === before) return told;
  }
}

const aboutOf = (response) => JSON.parse(response.headers.get("X-Slsd-About") || "{}");
const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

// What went wrong, by who asked: it is shown until the same one succeeds. The dialog speaks for a missing token.
const complaints = new Map();

function say(who, error) {
  complaints.delete(who);
  if (error && error.name !== "no_token") complaints.set(who, error.message);
  showComplaints();
}

function showComplaints() {
  $("message").hidden = complaints.size === 0;
  $("message").textContent = [...new Set(complaints.values())].join(" ");
}

// Whether a button may be pressed, apart from what it is doing now.
function allow(button, may) {
  button.dataset.may = may ? "yes" : "no";
  button.disabled = !may || button.dataset.busy === "yes";
}

// Runs what a button asks for; its error is shown, and the button waits meanwhile.
function onClick(button, action) {
  button.addEventListener("click", async () => {
    button.dataset.busy = "yes";
    button.disabled = true;
    try {
      await action();
      say("button", null);
    } catch (error) {
      say("button", error);
    }
    button.dataset.busy = "no";
    button.disabled = button.dataset.may === "no";
  });
}

function saveAs(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

// ---- devices ----

const kStates = {
  ready: ["good", "ready"],
  capturing: ["good", "is taking a frame"],
  opening: ["wait", "is opening"],
  absent: ["bad", "not found", "Check its cable and its power. The service keeps looking for it."],
  faulted: ["bad", "does not work", "Check its cable. The service reopens it."]};

function element(tag, text, kind) {
  const made = document.createElement(tag);
  made.textContent = text;
  if (kind) made.className = kind;
  return made;
}

function deviceItem(device, what) {
  const [kind, words, remedy] = kStates[device.state] || ["wait", device.state];
  const item = document.createElement("li");
  item.append(element("strong", what + " "), element("span", words, kind));
  item.append(element("span", ` · ${device.device || device.driver}, ${device.width_px} × ${device.height_px} px`));
  if (device.shows) item.append(element("span", ` · shows ${device.shows}`));
  if (device.frames !== undefined) item.append(element("span", ` · ${device.frames} frames, ${device.frames_lost} lost`));
  if (device.problem) item.append(element("span", device.problem, "remedy bad"));
  if (remedy) item.append(element("span", remedy, "remedy"));
  const drift = device.calibration;
  if (drift && drift.off_since_scan !== null) {
    item.append(element("span", `Knocked out of its calibration since scan ${drift.off_since_scan}: points lie ` +
      `${drift.epipolar_px.toFixed(2)} px off, ${drift.limit_px.toFixed(2)} are fine. Fasten projector and camera, stop the ` +
      "service and run slsd --correct with a board in view. If it refuses, calibrate again.", "remedy bad"));
  }
  return item;
}

function stateInWords({status}) {
  const devices = [["the projector", status.projector], ...status.cameras.map((camera) => [`camera ${camera.name}`, camera])];
  const bad = devices.find(([, device]) => !["ready", "capturing"].includes(device.state));
  if (status.cameras.length === 0) return ["bad", "No camera is configured: add one to slsd.toml."];
  if (bad) return [kStates[bad[1].state][0], `Not ready: ${bad[0]} ${kStates[bad[1].state][1]}.`];
  if (status.calibrating) return ["wait", "Calibrating."];
  if (!status.calibration) return ["bad", "Not calibrated: calibrate the scanner."];
  if (status.cameras.some((camera) => camera.calibration && camera.calibration.off_since_scan !== null))
    return ["bad", "Knocked out of its calibration: clouds may be wrong."];
  return ["good", "Ready to scan."];
}

let densityChosen = false, mayAdminister = false;

function showStatus(told) {
  const {status} = told;
  mayAdminister = status.role === "administer";
  if (!densityChosen && $("density").value !== told.density) {
    $("density").value = told.density;
    offerColours();
  }
  allow($("calibrate-begin"), mayAdminister);
  allow($("take-pose"), mayAdminister);
  showPresets();
  allow($("expose"), mayAdminister);
  allow($("box-for-all"), mayKeepBox());
  if (!mayAdminister) $("calibrate-next").textContent =
    "slsd-web may not administer this scanner; docs/page.md says how to allow it.";
  const [kind, words] = stateInWords(told);
  $("state").className = kind;
  $("state").textContent = words;
  $("device-list").replaceChildren(
    deviceItem(status.projector, "Projector"),
    ...status.cameras.map((camera) => deviceItem(camera, `Camera ${camera.name}`)));
  const scans = status.scans;
  const failed = Object.values(scans.failed).reduce((sum, count) => sum + count, 0);
  $("figures").textContent = `slsd ${status.version}, up ${Math.round(status.uptime_s)} s: ${countOf(scans.succeeded, "scan")}, ` +
    `${failed} failed; decoding takes ${scans.decode_ms.mean.toFixed(1)} ms, ${scans.latency_ms.mean.toFixed(1)} ms to the ` +
    `client; ${countOf(status.clients, "client")}; ${(status.resident_bytes / 1048576).toFixed(0)} MiB.` +
    (scans.last_error ? ` Last error: ${scans.last_error.message}` : "");
  cameraSizes = status.cameras.map(({width_px: width, height_px: height}) => ({width, height}));
  showCameras(status.cameras.map((camera) => camera.name));
  showSettings(told.cameras);
  followPart(told.part);
  showPast(told.past);
}

let cameraSizes = [];

const sizeOfCamera = (index) => cameraSizes[index];

function showCameras(names) {
  const choice = $("which-camera");
  if ([...choice.options].map((option) => option.value).join("\n") === names.join("\n")) return;
  choice.replaceChildren(...names.map((name) => Object.assign(element("option", name), {value: name})));
}

async function followStatus() {
  for (;; await pause(kStatusPause)) {
    if (document.hidden) continue;
    try {
      showStatus(await askState("api/status", kStatusTimeout));
      if ($("login").open) welcome();  // let in by another tab
      else if (complaints.has("camera") && !$("camera-live").checked) showPicture();  // it failed by itself, and is tried again
    } catch (error) {
      $("state").className = "bad";
      $("state").textContent = error.message;
    }
  }
}

// ---- camera ----

async function takePicture() {
  const figures = await drawFrame($("picture"), await askFrame($("which-camera").value),
                                  {clipping: $("show-clipping").checked, sharpness: $("show-sharpness").checked});
  $("picture-figures").textContent = `${figures.width} × ${figures.height} px, ${(100 * figures.clipped).toFixed(2)} % clipped` +
    (figures.sharpness === null ? "; too little contrast to judge the sharpness"
                                : `; sharpness ${figures.sharpness.toFixed(2)} (1: edges within two pixels)`);
}

// @return whether there was one; why not is told
async function showPicture() {
  try {
    await takePicture();
    say("camera", null);
    return true;
  } catch (error) {
    say("camera", error);
    return false;
  }
}

async function followCamera() {
  for (;; await pause(50)) {
    if (!$("camera-live").checked || document.hidden) continue;
    if (!await showPicture()) await pause(kRetryPause);
  }
}

// A frame with the rule that rejected each region, and what to do about it.
async function showReasons() {
  const told = await (await ask("api/reasons?camera=" + encodeURIComponent($("which-camera").value))).json();
  const bytes = Uint8Array.from(atob(told.png), (letter) => letter.charCodeAt(0));
  const image = await createImageBitmap(new Blob([bytes], {type: "image/png"}));
  fitCanvas($("reasons"), image);
  $("reasons").getContext("2d").drawImage(image, 0, 0);
  $("reasons-list").replaceChildren(...told.reasons.map((reason) => {
    const row = element("tr", "");
    row.append(element("td", String(reason.regions)), element("td", `${reason.number} ${reason.rule.replaceAll("_", " ")}`),
               element("td", reason.meaning), element("td", reason.remedy));
    return row;
  }));
  $("reasons").hidden = $("reasons-list").hidden = false;
}

// ---- history ----

let pastShown = "";

function showPast(past) {
  const told = JSON.stringify(past);
  if (told === pastShown) return;
  pastShown = told;
  $("past").replaceChildren(...past.map((scan) => {
    const item = document.createElement("li");
    if (scan.error) {
      item.append(element("span", scan.time), element("span", scan.error, "bad"));
      return item;
    }
    item.append(element("span", scan.time), element("span", `${scan.points.toLocaleString("en")} points, ${scan.scan}`));
    if (scan.kept) {
      const button = element("button", "Show");
      onClick(button, async () => {
        const response = await ask("api/past?scan=" + encodeURIComponent(scan.scan));
        $("cloud-live").checked = false;
        showCloud(await response.arrayBuffer(), scan);
        choose("cloud");
      });
      item.append(button);
    }
    return item;
  }));
  if (past.length === 0) $("past").append(element("li", "No scans from this page yet."));
}

// ---- the whole ----

const isShown = (name) => $(name).offsetParent !== null;

function choose(name) {
  for (const button of document.querySelectorAll("nav button")) button.classList.toggle("chosen", button.dataset.view === name);
  for (const section of document.querySelectorAll("main section")) section.classList.toggle("chosen", section.id === name);
}

// The token was right: what was refused without it is no news any more.
function welcome() {
  $("login").close();
  $("token").value = $("login-message").textContent = "";
  complaints.clear();
  showComplaints();
  showPicture();
}

// The address that slsd-web printed leads here by way of a key; a token that is still there was not accepted.
function readAddress() {
  const key = /^#key=([0-9a-f]+)$/.exec(location.hash);
  if (key) keepKey(key[1]);
  if (/[?&]token=/.test(location.search))
    $("login-message").textContent = "The token in this address is not the scanner's. slsd-web makes a new one " +
      "whenever it starts, unless it has a token file.";
  if (key || location.search) history.replaceState(null, "", location.pathname);
}

function begin() {
  readAddress();
  for (const button of document.querySelectorAll("nav button"))
    button.addEventListener("click", () => choose(button.dataset.view));
  choose("devices");
  for (const button of document.querySelectorAll("[data-project]")) {
    onClick(button, async () => {
      await ask("api/project", {picture: button.dataset.project});
      await takePicture();
    });
  }
  beginExposure();
  beginSliders();
  onClick($("ask-reasons"), showReasons);
  for (const id of ["show-clipping", "show-sharpness"]) $(id).addEventListener("change", showPicture);
  $("login-form").addEventListener("submit", async (event) => {
    event.preventDefault();
    try {
      keepKey((await (await ask("api/login", {token: $("token").value})).json()).key);
      welcome();
    } catch (error) {
      $("login-message").textContent = error.message;
    }
  });
  beginCloud();
  const pictured = showPicture();
  followStatus();
  followCamera();
  beginCalibrating();
  beginBoards();
  beginHandEye();
  beginPresets();
  beginModel();
  beginKeys();
  // What draws clouds is large, and would hold the picture up; a camera that is gone does not hold it up for long.
  Promise.race([pictured, pause(3000)]).then(prepareCloud);
}

begin();
