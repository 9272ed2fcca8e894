/** Starts the page and shows the section in the address. */

import * as calibrate from "./calibrate.js";
import * as cameras from "./cameras.js";
import * as detect from "./detect.js";
import { find } from "./dom.js";
import * as floor from "./floor.js";
import * as frame from "./frame.js";
import * as key from "./key.js";
import { loadCalibrations } from "./parameters.js";
import { shown } from "./progress.js";
import * as views from "./views.js";
import * as zones from "./zones.js";

const SECTIONS = { cameras, detect, views, floor, calibrate, zones };

/** The camera of an address. */
function cameraNamed(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

function showSection() {
  const [name, ...rest] = location.hash.slice(1).split("/");
  const wanted = Object.hasOwn(SECTIONS, name) ? name : "cameras";
  const camera = name === "camera" ? cameraNamed(rest.join("/")) : "";
  for (const [other, section] of Object.entries(SECTIONS)) {
    const isShown = other === wanted;
    find(`#section-${other}`).hidden = !isShown;
    const link = find(`nav a[href="#${other}"]`);
    if (isShown) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
    section.visible?.(isShown, camera);
  }
  document.title = wanted === "cameras" && !camera ? "Lookdown" : `${find(`#section-${wanted} h1`).textContent} – Lookdown`;
}

const load = shown(loadCalibrations);
// The address names the section, so the link does not change it.
find("#skip").addEventListener("click", (event) => {
  event.preventDefault();
  find("#main").focus();
});

frame.start();
for (const section of Object.values(SECTIONS)) section.start();
key.start(() => {
  load();
  detect.runShown();
  cameras.restart();
});
load();
window.addEventListener("hashchange", showSection);
showSection();
