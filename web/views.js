/** The section Views: the views of a frame and the persons in each. */

import { element, find, percent, plural, shape } from "./dom.js";
import { center, holds, points } from "./geometry.js";
import { assumedCircle, calibrationOf } from "./lens.js";
import { drawMarks, pointOut } from "./marks.js";
import { shown, withProgress } from "./progress.js";
import { askJson } from "./server.js";
import { change, shared, whenChanged } from "./shared.js";
import { viewCanvas } from "./straighten.js";

export const GRID_CELLS = 16;
/** The longer side of a straightened view, pixels. */
const TILE_PIXELS = 224;

let isVisible = false;
let shownReport = null;
let plan = null;
let chosen = null;

/** Requests the view plan of a report. */
async function planOf(report) {
  const query = `profile=${report.profile}&grid=${GRID_CELLS}`;
  if (!report.calibration.assumed) {
    return askJson(`calibrations/${report.calibration.id}/views?${query}`);
  }
  const file = calibrationOf({ id: "assumed", ...assumedCircle(report) });
  return askJson(`calibrations/assumed/views?${query}`, { method: "POST", body: JSON.stringify(file) });
}

async function show() {
  const { report, frame } = shared;
  find("#views-empty").hidden = Boolean(report);
  find("#views-content").hidden = !report;
  if (!isVisible || !report || report === shownReport) return;
  const sheet = find("#sheet");
  const loaded = await withProgress(find("#views-progress"), "Straightening the views", () => planOf(report));
  if (report !== shared.report) return;
  [shownReport, plan, chosen] = [report, loaded, null];
  const image = find("#views-frame");
  image.src = frame.url;
  image.width = frame.width;
  image.height = frame.height;
  drawOutlines();
  drawMarks(find("#views-marks"), report);
  find("#people").replaceChildren(...report.persons.map(chip));
  const facts = `${plural(plan.views.length, "view")} of the profile ${plan.profile} see `;
  find("#views-facts").textContent = plan.views.length
    ? `${facts}${percent(plan.coverage)} of the lens image, and each point of it in ${plan.overlap.toFixed(1)} views on average.${secondLook(plan.cost)}`
    : "The profile direct uses the whole frame: there are no views.";
  sheet.classList.toggle("small", plan.views.length > 48);
  sheet.replaceChildren(...plan.views.map((view, index) => tile(view, index, frame, report)));
  pointOutAll();
}

/** States how many more inputs possible persons may get. */
function secondLook({ crops_at_most: crops }) {
  return crops ? ` Possible persons are seen again in up to ${plural(crops, "upright crop")}.` : "";
}

function drawOutlines() {
  const drawing = find("#outlines");
  const [width, height] = plan.image;
  drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const unit = Math.max(width, height) / 480;
  const outline = (view, index) =>
    shape("polygon", { points: points(view.outline), "data-view": index, "stroke-width": unit });
  drawing.replaceChildren(...plan.views.map(outline));
}

function chip(_person, index) {
  const toggle = () => change("person", shared.person === index ? null : index);
  return element("button", { type: "button", class: "chip", "data-person": index, onclick: toggle }, String(index + 1));
}

const small = (person) => element("i", {}, `${person + 1} `);

/** The center of a person's box in pixels of the frame size of the plan. */
const placeOf = (person, report) => center(person).map((value) => (value * plan.image[0]) / report.image.width);

function tile(view, index, frame, report) {
  const inSight = report.persons.flatMap((person, at) => (holds(view.outline, placeOf(person, report)) ? [at] : []));
  const canvas = viewCanvas(view, GRID_CELLS, frame, plan.image[0], TILE_PIXELS);
  canvas.setAttribute("aria-hidden", "true");
  const where = `, ${Math.round(view.off_axis_deg)}° off axis, ${inSight.length ? "with" : "without persons"} `;
  const choose = () => {
    chosen = chosen === index ? null : index;
    pointOutAll();
  };
  const over = (at) => () => find("#outlines").children[index].classList.toggle("over", at);
  return element(
    "button",
    { type: "button", class: "tile", "aria-pressed": "false", "data-holds": inSight.join(" "),
      onclick: choose, onmouseenter: over(true), onmouseleave: over(false), onfocus: over(true), onblur: over(false) },
    canvas,
    element(
      "span",
      { class: "caption" },
      element("b", {}, element("span", { class: "unseen" }, "View "), String(index + 1), element("span", { class: "unseen" }, where)),
      element("span", {}, inSight.map(small)),
    ),
  );
}

function pointOutAll() {
  pointOut(find("#views-marks"));
  for (const node of find("#people").children) {
    node.setAttribute("aria-pressed", String(Number(node.dataset.person) === shared.person));
  }
  [...find("#sheet").children].forEach((node, index) => {
    const sees = shared.person === null || node.dataset.holds.split(" ").includes(String(shared.person));
    node.classList.toggle("dim", !sees);
    node.setAttribute("aria-pressed", String(index === chosen));
    const outline = find("#outlines").children[index];
    outline.classList.toggle("sees", shared.person !== null && sees);
    outline.classList.toggle("chosen", index === chosen);
  });
}

const showShown = shown(show);

export function visible(is) {
  isVisible = is;
  showShown();
}

export function start() {
  whenChanged(["report"], showShown);
  whenChanged(["person"], () => plan && pointOutAll());
}
