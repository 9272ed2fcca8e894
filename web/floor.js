/** The section Floor: persons from above, if the camera height is known. */

import { element, find, plural, shape } from "./dom.js";
import { VIEW_BOX, floorDot, floorGrid, floorPlaces, reachOf, scaleOf } from "./floor_map.js";
import { points } from "./geometry.js";
import { shown, withProgress } from "./progress.js";
import { askJson } from "./server.js";
import { change, shared, whenChanged } from "./shared.js";
import { pointOut } from "./marks.js";

/** The interval at which the newest report of a live camera is read. */
const MILLIS = 1000;

let isVisible = false;
/** The newest report of the camera whose frame is used. */
let live = null;
let isAsking = false;
let shownReport = null;
let calibration = { revision: null, file: null };

async function show() {
  const report = live ?? shared.report;
  const standing = report?.persons.filter((person) => person.floor) ?? [];
  const isKnown = standing.length > 0;
  find("#floor-empty").hidden = isKnown;
  find("#floor-content").hidden = !isKnown;
  find("#floor-reason").textContent = reason(report);
  if (!isVisible || !isKnown || report === shownReport) return;
  shownReport = report;
  const { id, revision } = report.calibration;
  if (calibration.revision !== revision) {
    const file = await withProgress(find("#floor-progress"), "Reading the calibration", () => askJson(`calibrations/${id}`));
    calibration = { revision, file };
  }
  if (report === shownReport) draw(report, calibration.file);
}

/** Shows the newest report of the camera whose frame is used. */
async function follow() {
  const camera = shared.frame?.camera;
  if (!isVisible || !camera || isAsking) return;
  isAsking = true;
  const report = await askJson(`results/${encodeURIComponent(camera)}/latest`).catch(() => null);
  isAsking = false;
  if (camera !== shared.frame?.camera) return;
  live = report;
  showShown();
}

function reason(report) {
  if (!report) return "Use the frame of a camera in Cameras, or pick one in Detect: its persons are shown here from above.";
  if (!report.persons.length) return live ? "The camera sees no persons now." : "This frame has no persons.";
  return "The height of this camera above the floor is not known. Save a calibration with the height in Calibrate, and choose it in Detect.";
}

function draw(report, file) {
  const zones = (file.zones ?? []).filter((zone) => zone.floor_m);
  const places = floorPlaces(report.persons);
  const reach = reachOf(places.filter(Boolean));
  const scale = scaleOf(reach);
  const areas = zones.map((zone) => {
    const outline = zone.floor_m.map((place) => place.map((value) => value * scale));
    return shape("polygon", { points: points(outline), class: "zone" }, shape("title", {}, zone.name));
  });
  const drawing = find("#map");
  drawing.setAttribute("viewBox", VIEW_BOX);
  drawing.setAttribute("aria-label", `${plural(places.filter(Boolean).length, "person")} on the floor, seen from above`);
  drawing.replaceChildren(
    ...floorGrid(reach),
    ...areas,
    ...places.flatMap((place, index) => (place ? [floorDot(place, index, scale, over(index))] : [])),
  );
  find("#floor-facts").textContent = `The diamond in the middle is the camera, ${file.mount.height_m} m above the floor. Right and down are the directions in the frame.`;
  find("#places").replaceChildren(...report.persons.map(row));
}

const over = (index) => ({ onmouseenter: () => change("person", index), onmouseleave: () => change("person", null) });

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
  whenChanged(["frame"], () => {
    live = null;
  });
  setInterval(follow, MILLIS);
  whenChanged(["person"], () => {
    for (const id of ["#map", "#places"]) pointOut(find(id));
  });
}
