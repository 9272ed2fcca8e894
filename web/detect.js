/** The section Detect: shows a frame with its persons; every change of a parameter runs detection again. */

import { afterPause, element, find } from "./dom.js";
import { clearFindings, showFindings } from "./findings.js";
import { drawMarks, pointOut } from "./marks.js";
import * as parameters from "./parameters.js";
import { shown, withProgress } from "./progress.js";
import { askJson } from "./server.js";
import { change, shared, whenChanged } from "./shared.js";

/** The pause after the last change of a slider before the request. */
const REST_MILLIS = 150;

let running = null;

async function run() {
  const { frame } = shared;
  if (!frame) return;
  runSoon.cancel();
  running?.abort();
  const now = new AbortController();
  running = now;
  const path = `detect?${parameters.query()}`;
  const options = { method: "POST", body: frame.blob, signal: now.signal };
  const report = await withProgress(find("#stage"), "Detecting persons", () => askJson(path, options));
  if (shared.frame === frame && running === now) change("report", report);
}

export const runShown = shown(run);
const runSoon = afterPause(REST_MILLIS, runShown);

function showFrame() {
  const { frame } = shared;
  const image = find("#frame");
  image.src = frame.url;
  image.width = frame.width;
  image.height = frame.height;
  image.alt = `The frame ${frame.name}`;
  find("#stage").classList.remove("blank");
  clearFindings();
  find("#stage").style.aspectRatio = `${frame.width} / ${frame.height}`;
  runShown();
}

function showReport() {
  const { report } = shared;
  find("#report-link").hidden = !report;
  if (!report) {
    find("#marks").replaceChildren();
    clearFindings();
    return;
  }
  drawMarks(find("#marks"), report);
  pointOut(find("#marks"));
  showFindings(report);
}

/** Downloads the report as a file. */
function save() {
  const blob = new Blob([JSON.stringify(shared.report, null, 1)], { type: "application/json" });
  const url = URL.createObjectURL(blob);
  element("a", { href: url, download: "report.json" }).click();
  URL.revokeObjectURL(url);
}

export function start() {
  parameters.start(runSoon);
  find("#report-link").addEventListener("click", save);
  // Marks keep their size on the screen for all image sizes.
  new ResizeObserver(() => shared.report && drawMarks(find("#marks"), shared.report)).observe(find("#marks"));
  whenChanged(["frame"], showFrame);
  whenChanged(["report"], showReport);
  whenChanged(["person"], () => {
    pointOut(find("#marks"));
    pointOut(find("#persons"));
  });
  clearFindings();
}
