/** Persons drawn over their frame. */

import { plural, shape } from "./dom.js";
import { center, corners, points } from "./geometry.js";
import { change, shared } from "./shared.js";

/** The default side of an image with an unknown size on the screen, CSS pixels. */
const USUAL_SIDE = 480;

/** Draws the persons of `report` over its frame, with pointer events. */
export function drawMarks(drawing, report) {
  const { width, height } = report.image;
  const scale = Math.min(drawing.clientWidth / width, drawing.clientHeight / height) || USUAL_SIDE / Math.max(width, height);
  drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
  drawing.replaceChildren(...report.persons.map((person, index) => mark(person, index, 1 / scale)));
}

/** A mark with line widths in multiples of `pixel`, frame pixels. */
function mark(person, index, pixel) {
  const outline = points(corners(person.oriented_box));
  const [x, y] = center(person);
  return shape(
    "g",
    { class: "mark", "data-person": index, onmouseenter: () => change("person", index), onmouseleave: () => change("person", null) },
    shape("polygon", { points: outline, class: "casing", "stroke-width": 4.6 * pixel }),
    shape("polygon", { points: outline, class: "line", "stroke-width": 2.2 * pixel }),
    shape("circle", { cx: x, cy: y, r: 10 * pixel, class: "badge" }),
    shape("text", { x, y: y + 4.3 * pixel, "font-size": 12 * pixel, class: "number" }, String(index + 1)),
  );
}

/** A thumbnail of the persons in the lens circle. */
export function sketch(report) {
  const { width, height } = report.image;
  const side = Math.min(width, height);
  const label = `Positions of ${plural(report.persons.length, "person")} in the frame`;
  const box = ({ oriented_box: box }) => shape("polygon", { points: points(corners(box)), "stroke-width": side / 75 });
  return shape(
    "svg",
    { class: "sketch", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label },
    shape("circle", { cx: width / 2, cy: height / 2, r: side / 2, class: "lens" }),
    shape("circle", { cx: width / 2, cy: height / 2, r: side / 4, class: "ring", "stroke-width": side / 240 }),
    ...report.persons.map(box),
  );
}

/** Highlights the person under the pointer. */
export function pointOut(drawing) {
  for (const node of drawing.querySelectorAll("[data-person]")) {
    node.classList.toggle("chosen", Number(node.dataset.person) === shared.person);
  }
}
