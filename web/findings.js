/** The results: the list of persons, the time per stage, warnings. */

import { element, find, plural } from "./dom.js";
import { change, shared } from "./shared.js";

const STAGES = ["decode", "calibrate", "queue", "remap", "inference", "refine"];
const STAGE_WORDS = {
  decode: "Decode",
  calibrate: "Lens",
  queue: "Wait",
  remap: "Straighten",
  inference: "Network",
  refine: "Merge",
};

/** Formats a duration with its significant digits. */
export const millis = (value) => (value < 9.95 ? value.toFixed(1) : String(Math.round(value)));

export function showFindings(report) {
  const { persons, views, timings_ms: timings } = report;
  const used = views.inferred + views.unchanged;
  find("#count").textContent = persons.length;
  find("#count-word").textContent = persons.length === 1 ? "person" : "persons";
  find("#summary").textContent =
    `${plural(used, "view")}${views.inferred ? "" : " cached"}, ${millis(timings.total)} ms, ${report.model.name}, ${report.refinement.name}`;
  find("#announcement").textContent = `${plural(persons.length, "person")} found in ${millis(timings.total)} milliseconds.`;
  find("#persons").replaceChildren(...persons.map(row));
  find("#no-persons").hidden = persons.length > 0;
  showTimings(timings);
  find("#warnings").replaceChildren(...report.warnings.map(({ message }) => element("li", {}, message)));
}

function row(person, index) {
  const facts = [plural(person.views, "view")];
  if (person.floor) facts.push(`${Math.hypot(person.floor.x_m, person.floor.y_m).toFixed(1)} m away`);
  else if (person.bearing) facts.push(`${Math.round(person.bearing.off_axis_deg)}° off axis`);
  if (person.zones?.length) facts.push(`in ${person.zones.join(", ")}`);
  const bar = element("span", { class: "bar", "aria-hidden": "true" }, element("span"));
  bar.firstChild.style.width = `${person.score * 100}%`;
  const point = () => change("person", index);
  const leave = () => change("person", null);
  const button = element(
    "button",
    { type: "button", "data-person": index, onmouseenter: point, onmouseleave: leave, onfocus: point, onblur: leave, onclick: point },
    element("span", { class: "badge" }, String(index + 1)),
    element("span", { class: "score" }, person.score.toFixed(2)),
    bar,
    element("span", { class: "facts" }, facts.join(" · ")),
  );
  return element("li", {}, button);
}

function showTimings(timings) {
  const bar = STAGES.map((stage) => {
    const part = element("span", { class: "part", "data-stage": stage });
    part.style.flexGrow = timings[stage];
    return part;
  });
  find("#timing-bar").replaceChildren(...bar);
  const facts = STAGES.map((stage) =>
    element(
      "div",
      {},
      element("dt", {}, element("span", { class: "dot", "data-stage": stage, "aria-hidden": "true" }), STAGE_WORDS[stage]),
      element("dd", {}, `${millis(timings[stage])} ms`),
    ),
  );
  find("#timings").replaceChildren(...facts);
}

/** Clears all results. */
export function clearFindings() {
  find("#count").textContent = "–";
  find("#count-word").textContent = "persons";
  find("#summary").textContent = shared.frame ? shared.frame.name : "No frame yet";
  for (const id of ["#persons", "#timing-bar", "#timings", "#warnings"]) find(id).replaceChildren();
  find("#no-persons").hidden = true;
}
