/** Starts the page and shows the section in the address. */

import { find } from "./dom.js";
import * as calibrate from "./calibrate.js";
import * as detect from "./detect.js";
import * as floor from "./floor.js";
import * as frame from "./frame.js";
import * as key from "./key.js";
import * as live from "./live.js";
import { loadCalibrations } from "./parameters.js";
import { shown } from "./progress.js";
import * as views from "./views.js";
import * as zones from "./zones.js";

const SECTIONS = { detect, views, floor, calibrate, zones, live };

function showSection() {
  const name = location.hash.slice(1);
  const wanted = name in SECTIONS ? name : "detect";
  for (const [other, section] of Object.entries(SECTIONS)) {
    const isShown = other === wanted;
    find(`#section-${other}`).hidden = !isShown;
    const link = find(`nav a[href="#${other}"]`);
    if (isShown) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
    section.visible?.(isShown);
  }
  document.title = wanted === "detect" ? "Lookdown" : `${find(`#section-${wanted} h1`).textContent} – Lookdown`;
}

const load = shown(loadCalibrations);

frame.start();
for (const section of Object.values(SECTIONS)) section.start();
key.start(() => {
  load();
  detect.runShown();
  live.restart();
});
load();
window.addEventListener("hashchange", showSection);
showSection();
