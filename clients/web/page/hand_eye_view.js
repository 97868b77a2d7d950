// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// Hand-eye calibration: a view of the board for each pose of the robot, the next pose, the verdict and its file.
// slsctl hand-eye does the same, and docs/robot.md explains it.
const kHandEyePause = 2000, kSureFor = 5000;
const kXyz = ["x", "y", "z"];

// What robots write, in the order of their numbers; as pose_notation() of the program has them.
const kNotations = {
  ur: ["UR (m, rotation vector)", kXyz, "m", ["rx", "ry", "rz"], "rad"],
  "ur-pendant": ["UR's pendant (mm, rotation vector)", kXyz, "mm", ["rx", "ry", "rz"], "rad"],
  kuka: ["KUKA (mm, A B C)", ["X", "Y", "Z"], "mm", ["A", "B", "C"], "°"],
  fanuc: ["Fanuc (mm, W P R)", ["X", "Y", "Z"], "mm", ["W", "P", "R"], "°"],
  staubli: ["Stäubli (mm, RX RY RZ)", ["X", "Y", "Z"], "mm", ["RX", "RY", "RZ"], "°"],
  kawasaki: ["Kawasaki (mm, O A T)", ["X", "Y", "Z"], "mm", ["O", "A", "T"], "°"],
  abb: ["ABB (mm, q1 to q4)", kXyz, "mm", ["q1", "q2", "q3", "q4"], ""],
  ros: ["ROS (m, quaternion x y z w)", kXyz, "m", ["qx", "qy", "qz", "qw"], ""],
  matrix: ["4 × 4 matrix, mm", [], "", [...Array(16).keys()].map((i) => `m${Math.floor(i / 4) + 1}${i % 4 + 1}`), ""],
  "matrix-m": ["4 × 4 matrix, m", [], "", [...Array(16).keys()].map((i) => `m${Math.floor(i / 4) + 1}${i % 4 + 1}`), ""]};

const kMountingHelp = {
  arm: "Fasten the board in the cell, where the scanner on the arm can see it from many sides.",
  cell: "Fasten the board on the arm; the scanner stands in the cell."};

const kHandEyeChoices = ["mounted", "notation", "hand-eye-board", "hand-eye-ruler", "hand-eye-distance", "hand-eye-measured"];

let handEye = null, handEyeText = "", handEyePlaced = false;
const handEyeChosen = new Set();  // here, so the kept choices of before leave them alone

const needsOf = (notation) => kNotations[notation][1].length + kNotations[notation][3].length;

// An ABB robtarget or pose: its place and turn without configuration, outer axes and the text around them.
const kRobtarget = /\[\s*(\[[^[\]]*\]\s*,\s*\[[^[\]]*\])/;

// The numbers of a pose as a robot writes or shows it: {X 412.5, Y -231, ...}, p[0.41, ...], [[x, y, z], [q1, ...]].
function numbersOfPose(text, notation) {
  const robtarget = notation === "abb" ? text.match(kRobtarget) : null;
  if (robtarget) text = robtarget[1];
  return [...text.matchAll(/(?<![A-Za-z0-9_.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?/g)].map(([word]) => Number(word));
}

function poseInWords(numbers, notation) {
  const [, places, placeUnit, turns, turnUnit] = kNotations[notation];
  const named = [...places.map((name) => [name, placeUnit]), ...turns.map((name) => [name, turnUnit])];
  return numbers.map((number, i) => named[i] ? `${named[i][0]} ${number}${named[i][1] === "°" ? "" : " "}${named[i][1]}`.trim()
                                             : String(number)).join(", ");
}

function understandPose() {
  const notation = $("notation").value, numbers = numbersOfPose($("robot-pose").value, notation), needed = needsOf(notation);
  const right = numbers.length === needed;
  $("pose-read").className = numbers.length === 0 || right ? "" : "bad";
  $("pose-read").textContent = numbers.length === 0 ? `${needed} numbers` :
    right ? poseInWords(numbers, notation) : `${numbers.length} numbers instead of ${needed}: ${poseInWords(numbers, notation)}`;
  return right ? numbers : null;
}

// The program's words for a terminal, in those of the page.
function forThePage(message) {
  return message.replace(/use --poses ([\w-]+)/g, (all, name) => kNotations[name] ? `choose “${kNotations[name][0]}” above` : all)
    .replace("use --mounted arm", "choose “on the robot's arm” above").replace("use --mounted cell", "choose “in the cell” above")
    .replaceAll("leave it out", "delete it");
}

// ---- a view ----

async function drawPose(name) {
  const address = `api/hand_eye/look?look=${encodeURIComponent(name)}`;
  let cameras = [null];
  for (let i = 0; i < cameras.length; ++i) {
    const response = await ask(address + (cameras[i] === null ? "" : `&camera=${encodeURIComponent(cameras[i])}`));
    const {camera, cameras: all, points_px: points} = aboutOf(response);
    if (i === 0) {
      cameras = all;
      $("hand-eye-pictures").replaceChildren();
    }
    const image = await createImageBitmap(await response.blob());
    const figure = figureOf("view " + camera, image.width, image.height, $("hand-eye-pictures"));
    const context = figure.firstChild.getContext("2d");
    context.drawImage(image, 0, 0);
    context.fillStyle = "#3df06b";
    for (const [x, y] of points) {
      context.beginPath();
      context.arc(x, y, Math.max(2, image.width / 250), 0, 7);
      context.fill();
    }
    figure.lastChild.textContent = `${name}${camera ? ", camera " + camera : ""}: ` +
      (points.length > 0 ? `${points.length} points of the board` : "the board was not found, or not searched for yet: press Calculate");
  }
}

// The pictures of a refused view; they are not kept.
async function drawRefused() {
  $("hand-eye-pictures").replaceChildren();
  for (const {value: camera} of $("which-camera").options) {
    const frame = await askFrame(camera);
    const figure = figureOf("view " + camera, frame.width, frame.height, $("hand-eye-pictures"));
    figure.firstChild.getContext("2d").putImageData(imageOf(frame), 0, 0);
    figure.lastChild.textContent = `camera ${camera}: this view was not kept`;
  }
}

// A press that destroys asks once more.
function onSecondPress(button, question, action) {
  const words = button.textContent;
  let sureUntil = 0;
  onClick(button, async () => {
    if (Date.now() < sureUntil) {
      sureUntil = 0;
      button.textContent = words;
      return action();
    }
    sureUntil = Date.now() + kSureFor;
    button.textContent = question();
    setTimeout(() => { if (Date.now() >= sureUntil) button.textContent = words; }, kSureFor);
  });
}

function viewRow(view, notation) {
  const row = document.createElement("tr");
  row.dataset.pose = view.name;
  const cells = [view.name, poseInWords(view.pose, notation),
                 view.unused ? "not used: " + view.unused : view.corners === undefined ? "" : String(view.corners),
                 view.distance_mm === undefined ? "" : view.distance_mm.toFixed(0),
                 view.error_px === undefined ? "" : view.error_px.toFixed(3)];
  row.append(...cells.map((text) => element("td", text)));
  if (view.unused) row.children[2].className = "bad";
  const show = element("button", "Show"), erase = element("button", "Delete"), last = document.createElement("td");
  show.setAttribute("aria-label", `Show ${view.name}`);
  erase.setAttribute("aria-label", `Delete ${view.name}`);
  onClick(show, () => drawPose(view.name));
  onSecondPress(erase, () => "Sure?", () => act({action: "drop", look: view.name}, "Calculating…"));
  last.append(show, erase);
  row.append(last);
  return row;
}

// ---- the result ----

const quoted = (word) => /^[\w./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;

const installing = ({file, installs_to: place, reload}) => `sudo install -m 644 ${quoted(file)} ${quoted(place)} && ${reload}`;

function showResult(told) {
  $("hand-eye-result").hidden = !told.has_file;
  if (!told.has_file) return;
  $("hand-eye-command").textContent = told.installs_to ? installing(told) : "the service does not answer";
  $("hand-eye-table").hidden = told.configured !== false;
  $("hand-eye-table").textContent = `Before that, once, add this to ${told.configuration}:\n\n[frame]\noutput = "robot_base"\nhand_eye = "${told.installs_to}"`;
}

function verdictLines({outcome, error}) {
  const lines = error ? forThePage(error.message).split("\n").map((line) => element("p", line.trim(), "bad")) : [];
  if (!outcome) return lines;
  if (outcome.missing) lines.push(element("p", forThePage(outcome.missing), "wait"));
  if (outcome.verdict) {
    lines.push(element("p", `The calibration is ${outcome.verdict}: 95 % of points at ${outcome.distance_mm.toFixed(0)} mm are placed within ` +
      `${outcome.error_mm.toFixed(2)} mm.`, {good: "good", usable: "wait"}[outcome.verdict] || "bad"));
    lines.push(element("p", `The robot's poses have a noise of ${outcome.robot_place_sigma_mm.toFixed(3)} mm and ` +
      `${(outcome.robot_turn_sigma_rad * 180 / Math.PI).toFixed(3)}°.`));
  }
  if (outcome.next) lines.push(element("p", outcome.next[0].toUpperCase() + outcome.next.slice(1) + "."));
  if (outcome.next_pose) lines.push(element("p", "Drive there slowly: slsd does not know what the arm can reach."));
  return lines;
}

function placeChoices({mounted, poses, board, ruler, distance_mm: distance, measured_mm: measured}) {
  const kept = [mounted, poses, board || "", ruler || "", distance || "", (measured || []).join(", ")];
  kHandEyeChoices.forEach((id, i) => { if (!handEyeChosen.has(id)) $(id).value = kept[i]; });
  showMounting();
}

function showMounting() {
  $("mounting-help").textContent = kMountingHelp[$("mounted").value];
  understandPose();
}

function showHandEye(told) {
  const text = JSON.stringify(told);
  if (text === handEyeText) return;
  [handEye, handEyeText] = [told, text];
  if (!handEyePlaced) placeChoices(told.choices);
  handEyePlaced = true;
  const {looks: views, outcome, choices} = told;
  $("hand-eye-views").hidden = views.length === 0;
  $("hand-eye-views").caption.textContent = `${countOf(views.length, "view")}; 12 or more are better`;
  $("hand-eye-views").tBodies[0].replaceChildren(...views.map((view) => viewRow(view, choices.poses)));
  allow($("hand-eye-calculate"), views.length > 0);
  allow($("hand-eye-clear"), views.length > 0);
  allow($("use-next"), Boolean(outcome && outcome.next_pose));
  $("hand-eye-verdict").replaceChildren(...verdictLines(told));
  if (told.busy) $("hand-eye-state").textContent = "A view is being taken or evaluated…";
  else if (/being taken/.test($("hand-eye-state").textContent)) $("hand-eye-state").textContent = "";
  showResult(told);
}

// ---- what is done ----

function choicesMade() {
  const made = {mounted: $("mounted").value, poses: $("notation").value};
  for (const name of ["board", "ruler"]) if ($("hand-eye-" + name).value.trim()) made[name] = $("hand-eye-" + name).value.trim();
  if ($("hand-eye-distance").value) made.distance_mm = Number($("hand-eye-distance").value);
  if ($("hand-eye-measured").value.trim()) made.measured_mm = numbersOfPose($("hand-eye-measured").value);
  return made;
}

async function act(body, words) {
  $("hand-eye-state").className = "";
  $("hand-eye-state").textContent = words;
  try {
    const told = await (await ask("api/hand_eye/act", body, 6 * 60 * 1000)).json();
    $("hand-eye-state").textContent = "";
    showHandEye(told);
    return told;
  } catch (error) {
    $("hand-eye-state").textContent = "";
    throw error;
  }
}

async function takePose() {
  const pose = understandPose();
  if (!pose) throw new Error(`Enter the robot's pose: ${kNotations[$("notation").value][0]} has ${needsOf($("notation").value)} numbers.`);
  const before = new Set(handEye ? handEye.looks.map((view) => view.name) : []);
  const told = await act({action: "take", pose, ...choicesMade()}, "Taking a view. The robot must stand still…");
  const taken = told.looks.find((view) => !before.has(view.name));
  $("hand-eye-state").className = taken ? "good" : "bad";
  $("hand-eye-state").textContent = taken ? `TAKEN ✓ ${taken.name}` : "Not taken";
  if (taken) $("robot-pose").value = "";
  understandPose();
  await (taken ? drawPose(taken.name) : drawRefused());
}

async function followHandEye() {
  for (;; await pause(kHandEyePause)) {
    if (document.hidden || !$("hand-eye").open || !isShown("hand-eye") || $("take-pose").dataset.busy === "yes") continue;
    try {
      showHandEye(await askState("api/hand_eye"));
      say("hand-eye", null);
    } catch (error) {
      say("hand-eye", error);
    }
  }
}

function beginHandEye() {
  $("notation").replaceChildren(...Object.entries(kNotations).map(([name, [words]]) => Object.assign(element("option", words), {value: name})));
  for (const id of kHandEyeChoices)
    for (const kind of ["input", "change"]) $(id).addEventListener(kind, () => handEyeChosen.add(id));
  for (const id of ["mounted", "notation"]) $(id).addEventListener("change", showMounting);
  $("robot-pose").addEventListener("input", understandPose);
  $("robot-pose").addEventListener("keydown", (event) => {
    if (event.key === "Enter") press("take-pose");
  });
  onClick($("take-pose"), takePose);
  onClick($("hand-eye-calculate"), () => act({action: "calculate", ...choicesMade()}, "Calculating…"));
  onSecondPress($("hand-eye-clear"), () => `Delete ${countOf(handEye.looks.length, "view")}?`, async () => {
    await act({action: "clear"}, "");
    $("hand-eye-pictures").replaceChildren();
  });
  onClick($("use-next"), async () => {
    $("robot-pose").value = handEye.outcome.next_pose.join(", ");
    understandPose();
  });
  onClick($("hand-eye-save"), async () => saveAs(await (await ask("api/hand_eye/file")).blob(), "hand_eye.yml"));
  showMounting();
  followHandEye();
}
