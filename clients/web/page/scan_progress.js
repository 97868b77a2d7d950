// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// How far a scan is: the time that it takes by what the last one of its kind took, then the bytes that have come.
const kProgressPause = 100;
const lastTook = {};  // ms, by density

const inMegabytes = (bytes) => (bytes / 1e6).toFixed(1);

function showProgress(text, share) {
  $("progress").hidden = text === null;
  if (text === null) return;
  $("progress-text").textContent = text;
  if (share === null) $("progress-bar").removeAttribute("value");  // how much there is, is unknown
  else $("progress-bar").value = share;
}

function waitingInWords(passed, usual) {
  const seconds = (passed / 1000).toFixed(1);
  if (!usual) return [`Scanning: ${seconds} s`, null];
  if (passed > usual) return [`Scanning: ${seconds} s, the last took ${(usual / 1000).toFixed(1)} s`, null];
  return [`Scanning: ${seconds} of about ${(usual / 1000).toFixed(1)} s`, passed / usual];
}

// Asks for a scan, and shows how far it is. @return the whole answer's bytes
async function askWithProgress(path, body, density) {
  const begin = performance.now();
  const tell = () => showProgress(...waitingInWords(performance.now() - begin, lastTook[density]));
  const timer = setInterval(tell, kProgressPause);
  try {
    tell();
    const response = await ask(path, body);
    lastTook[density] = performance.now() - begin;
    clearInterval(timer);
    const buffer = await readWithProgress(response);
    showProgress("Drawing", 1);
    await pause(0);
    return {buffer, about: aboutOf(response)};
  } finally {
    clearInterval(timer);
    setTimeout(showProgress, kProgressPause, null);
  }
}

async function readWithProgress(response) {
  const whole = Number(response.headers.get("Content-Length")), reader = response.body.getReader();
  const bytes = new Uint8Array(whole);
  for (let come = 0;;) {
    const {done, value} = await reader.read();
    if (done && come === whole) return bytes.buffer;
    if (done || come + value.length > whole) throw new Error("The cloud was cut off on its way: scan again.");
    bytes.set(value, come);
    come += value.length;
    showProgress(`Receiving: ${inMegabytes(come)} of ${inMegabytes(whole)} MB`, come / whole);
  }
}
