/** Persons drawn over their frame. */

import { plural, shape } from "./dom.js";
import { centre, corners, points } from "./geometry.js";
import { change, shared } from "./shared.js";

/** The side of a picture whose size on the screen is not known, CSS pixels. */
const USUAL_SIDE = 480;

/** Fills a drawing that lies over the frame of `report`; its persons can be pointed at. */
export function drawMarks(drawing, report) {
  const { width, height } = report.image;
  const scale = Math.min(drawing.clientWidth / width, drawing.clientHeight / height) || USUAL_SIDE / Math.max(width, height);
  drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
  drawing.replaceChildren(...report.persons.map((person, index) => mark(person, index, 1 / scale)));
}

/** A mark with lines of `pixel` times so many pixels of the frame. */
function mark(person, index, pixel) {
  const outline = points(corners(person.oriented_box));
  const [x, y] = centre(person);
  return shape(
    "g",
    { class: "mark", "data-person": index, onmouseenter: () => change("person", index), onmouseleave: () => change("person", null) },
    shape("polygon", { points: outline, class: "casing", "stroke-width": 4.6 * pixel }),
    shape("polygon", { points: outline, class: "line", "stroke-width": 2.2 * pixel }),
    shape("circle", { cx: x, cy: y, r: 10 * pixel, class: "badge" }),
    shape("text", { x, y: y + 4.3 * pixel, "font-size": 12 * pixel, class: "number" }, String(index + 1)),
  );
}

/** The persons in the circle of the lens, as small as a thumb. */
export function sketch(report) {
  const { width, height } = report.image;
  const side = Math.min(width, height);
  const label = `Where ${plural(report.persons.length, "person")} was seen in the frame`;
  const box = ({ oriented_box: box }) => shape("polygon", { points: points(corners(box)), "stroke-width": side / 75 });
  return shape(
    "svg",
    { class: "sketch", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label },
    shape("circle", { cx: width / 2, cy: height / 2, r: side / 2, class: "lens" }),
    shape("circle", { cx: width / 2, cy: height / 2, r: side / 4, class: "ring", "stroke-width": side / 240 }),
    ...report.persons.map(box),
  );
}

/** Points out the person that is pointed at. */
export function pointOut(drawing) {
  for (const node of drawing.querySelectorAll("[data-person]")) {
    node.classList.toggle("chosen", Number(node.dataset.person) === shared.person);
  }
}
