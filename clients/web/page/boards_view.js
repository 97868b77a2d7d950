// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// The boards that are ready to print: each as a PDF, and as the text that a calibration asks for.
const kPapers = {A4: [297, 210], A3: [420, 297], A2: [594, 420], A1: [841, 594], A0: [1189, 841]};

function paperName(width, height) {
  const [long, short] = [Math.max(width, height), Math.min(width, height)];
  const named = Object.entries(kPapers).find(([, size]) => Math.abs(size[0] - long) < 1 && Math.abs(size[1] - short) < 1);
  return named ? named[0] : `${Math.round(width)} × ${Math.round(height)} mm`;
}

const kBoardKinds = {
  charuco: (size, side) => `ChArUco, ${size} squares of ${side} mm`,
  chessboard: (size, side) => `chessboard, ${size} inner corners, squares of ${side} mm`,
  circles: (size, side) => `circles, ${size}, ${side} mm apart`,
  plane: (size, side) => `reference plane, ${size} markers, ${side} mm apart`};

function boardInWords(board) {
  const [kind, size, side] = board.split(":");
  return kBoardKinds[kind] ? kBoardKinds[kind](size.replace("x", " × "), side) : board;
}

function boardItem({name, board, width_mm: width, height_mm: height}) {
  const item = document.createElement("li"), pdf = element("button", "PDF"), use = element("button", "Use");
  const words = `${paperName(width, height)}: ${boardInWords(board)}`;
  pdf.setAttribute("aria-label", `Download the PDF of ${words}`);
  use.setAttribute("aria-label", `Calibrate with ${words}`);
  onClick(pdf, async () => saveAs(await (await ask("api/board?name=" + encodeURIComponent(name))).blob(), name + ".pdf"));
  onClick(use, async () => { $("board").value = board; });
  item.append(element("span", words), pdf, use);
  return item;
}

function beginBoards() {
  $("boards").addEventListener("toggle", async () => {
    if (!$("boards").open || $("board-list").children.length > 0) return;
    try {
      const {boards} = await (await ask("api/boards")).json();
      $("board-list").replaceChildren(...boards.map(boardItem));
      say("boards", null);
    } catch (error) {
      say("boards", error);
    }
  });
}
