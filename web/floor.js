/** The section Floor: persons from above, if the camera height is known. */

import { element, find, plural, shape } from "./dom.js";
import { points, roundStep } from "./geometry.js";
import { shown, withProgress } from "./progress.js";
import { askJson } from "./server.js";
import { change, shared, whenChanged } from "./shared.js";
import { pointOut } from "./marks.js";

/** Half the side of the drawing, in drawing units. */
const HALF = 240;
/** The minimum extent of the map, metres. */
const LEAST_REACH = 3;

let isVisible = false;
let shownReport = null;

async function show() {
  const { report } = shared;
  const standing = report?.persons.filter((person) => person.floor) ?? [];
  const isKnown = standing.length > 0;
  find("#floor-empty").hidden = isKnown;
  find("#floor-content").hidden = !isKnown;
  find("#floor-reason").textContent = reason(report);
  if (!isVisible || !isKnown || report === shownReport) return;
  shownReport = report;
  const path = `calibrations/${report.calibration.id}`;
  const file = await withProgress(find("#floor-progress"), "Reading the calibration", () => askJson(path));
  if (report === shared.report) draw(report, file);
}

function reason(report) {
  if (!report) return "Pick a frame in Detect first: its persons are shown here from above.";
  if (!report.persons.length) return "This frame has no persons.";
  return "The height of this camera above the floor is not known. Save a calibration with the height in Calibrate, and choose it in Detect.";
}

function draw(report, file) {
  const zones = (file.zones ?? []).filter((zone) => zone.floor_m);
  const distances = report.persons.flatMap(({ floor }) => (floor ? [Math.hypot(floor.x_m, floor.y_m)] : []));
  const reach = Math.max(LEAST_REACH, ...distances) * 1.12;
  const scale = HALF / reach;
  const step = roundStep(reach, 6);
  const rings = Array.from({ length: Math.floor(reach / step) }, (_, index) => (index + 1) * step);
  const lines = rings.flatMap((ring) => [
    shape("circle", { r: ring * scale, class: "ring" }),
    shape("text", { x: 4, y: -ring * scale - 4, class: "metres" }, `${ring} m`),
  ]);
  const areas = zones.map((zone) => {
    const outline = zone.floor_m.map((place) => place.map((value) => value * scale));
    return shape("polygon", { points: points(outline), class: "zone" }, shape("title", {}, zone.name));
  });
  const drawing = find("#map");
  drawing.setAttribute("viewBox", `${-HALF} ${-HALF} ${2 * HALF} ${2 * HALF}`);
  drawing.setAttribute("aria-label", `${plural(distances.length, "person")} on the floor, seen from above`);
  drawing.replaceChildren(
    shape("path", { d: `M${-HALF} 0H${HALF}M0 ${-HALF}V${HALF}`, class: "axis" }),
    ...lines,
    ...areas,
    shape("path", { d: "M-7 0L0 -7L7 0L0 7Z", class: "camera" }, shape("title", {}, "The camera")),
    ...report.persons.flatMap((person, index) => (person.floor ? [dot(person.floor, index, scale)] : [])),
  );
  find("#floor-facts").textContent = `The diamond in the middle is the camera, ${file.mount.height_m} m above the floor. Right and down are the directions in the frame.`;
  find("#places").replaceChildren(...report.persons.map(row));
}

const over = (index) => ({ onmouseenter: () => change("person", index), onmouseleave: () => change("person", null) });

function dot({ x_m: x, y_m: y }, index, scale) {
  return shape(
    "g",
    { class: "dot-mark", "data-person": index, transform: `translate(${x * scale} ${y * scale})`, ...over(index) },
    shape("circle", { r: 12 }),
    shape("text", {}, String(index + 1)),
  );
}

function row({ floor }, index) {
  const cells = floor
    ? [floor.x_m, floor.y_m, Math.hypot(floor.x_m, floor.y_m)].map((value) => `${value.toFixed(2).replace("-", "−")} m`)
    : ["unknown", "", ""];
  return element(
    "tr",
    { "data-person": index, ...over(index) },
    element("th", { scope: "row" }, element("span", { class: "badge" }, String(index + 1))),
    ...cells.map((cell) => element("td", {}, cell)),
  );
}

const showShown = shown(show);

export function visible(is) {
  isVisible = is;
  showShown();
}

export function start() {
  whenChanged(["report"], showShown);
  whenChanged(["person"], () => {
    for (const id of ["#map", "#places"]) pointOut(find(id));
  });
}
