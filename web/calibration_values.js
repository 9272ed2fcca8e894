/** The table of a calibration's values: each with its standard deviation and its source. */

import { SOURCE_WORDS } from "./calibration_sources.js";
import { element, find } from "./dom.js";

const number = (value, digits, unit = "") => (Number.isFinite(value) ? value.toFixed(digits) + unit : "");

/** The rows: a title, the entries of `sources` of which the first one counts, the value, and the unit of its standard deviation. */
const ROWS = [
  ["Lens", ["lens_model", "lens"], ({ lens }) => lens.model],
  ["Field of view", ["field_of_view", "lens"], ({ lens }) => number((lens.max_theta * 360) / Math.PI, 1, "°")],
  ["Radius", ["lens"], () => "", [2, " %"]],
  ["Center", ["center"], ({ lens }) => [lens.cx, lens.cy].map((value) => number(value + 0.5, 1)).filter(Boolean).join(", "), [1, " px"]],
  ["Tilt", ["world_up"], ({ mount }) => number(tiltOf(mount?.world_up), 1, "°"), [2, "°"]],
  ["Height", ["height_m"], ({ mount }) => number(mount?.height_m, 2, " m"), [2, " m"]],
];

/** The angle between the axis of a camera and straight down, degrees. */
const tiltOf = ([x, y, z] = []) => (Math.atan2(Math.hypot(x, y), -z) * 180) / Math.PI;

/**
 * The values of a file in the native format: `{title, value, spread, source}`. `spread`, the standard deviation, and
 * `source` are empty where they are not known.
 */
export function valuesOf(file) {
  return ROWS.flatMap(([title, names, textOf, unit]) => {
    const entry = names.map((name) => file.sources?.[name]).find(Boolean);
    const deviation = unit ? number(entry?.uncertainty, ...unit) : "";
    const row = { title, value: textOf(file), spread: deviation && `± ${deviation}`, source: SOURCE_WORDS[entry?.source] ?? "" };
    return row.value || row.spread ? [row] : [];
  });
}

/** Shows the values of a file, or hides the table if it is null. A found lens has `found`, its edges, and the values that it replaces. */
export function showValues(file, { found, replaces = [] } = {}) {
  const rows = file ? valuesOf(file) : [];
  if (file && found) rows.push({ title: "Edges", value: `${Math.round(found.explained * 100)} % of ${found.edges} follow the room` });
  find("#calibration-values").replaceChildren(...rows.map(rowOf));
  find("#calibration-values").hidden = !rows.length;
  find("#replaced-values").replaceChildren(...replaces.map((text) => element("li", {}, text)));
  find("#replaced-values").hidden = !replaces.length;
}

function rowOf({ title, value, spread, source }) {
  const deviation = spread ? element("span", { class: "spread" }, spread) : null;
  const text = element("dd", {}, value, value && deviation ? " " : "", deviation);
  return element("div", {}, element("dt", {}, title), text, source ? element("dd", { class: "source" }, source) : null);
}
