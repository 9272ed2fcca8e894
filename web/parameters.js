/** The parameters of the section Detect, as in the API. */

import { element, find } from "./dom.js";
import { ask, askJson } from "./server.js";
import { change, shared } from "./shared.js";

const SLIDERS = ["score_threshold", "iou_threshold", "sigma"];
/** The default refinements of profiles; `fusion` for all others. */
const OWN_REFINEMENT = { paper: "soft_nms_gaussian", direct: "nms" };

const form = () => find("#parameters");

/** The query of a request. Reports of the page are not stored. */
export function query() {
  const given = [...new FormData(form())].filter(([, value]) => value !== "");
  return new URLSearchParams([...given, ["camera", "web-page"], ["store", "false"]]);
}

export const profile = () => new FormData(form()).get("profile");

/** Shows the values, and disables those without effect. */
function show() {
  for (const name of SLIDERS) find(`output[for=${name}]`).textContent = Number(find(`#${name}`).value).toFixed(2);
  const refinement = find("#refine").value || OWN_REFINEMENT[profile()] || "fusion";
  find("#refine-own").textContent = `Default of the profile (${OWN_REFINEMENT[profile()] ?? "fusion"})`;
  find("#sigma").disabled = refinement !== "soft_nms_gaussian";
}

/** The calibrations of the opened sample frames, by ID. The server does not list them: they are part of the program. */
const samples = new Map();

/** Chooses the calibration of the sample frame `name`, unless the user has chosen another one. */
export async function chooseSample(name) {
  leaveSample();
  if (find("#calibration").value) return;
  const id = `sample-${name}`;
  const answer = await ask(`calibrations/${id}`);
  samples.set(id, { id, revision: answer.headers.get("ETag").slice(1, -1) });
  await loadCalibrations();
  find("#calibration").value = id;
}

/** Unchooses the calibration of a sample frame. */
export function leaveSample() {
  const choice = find("#calibration");
  if (samples.has(choice.value)) choice.value = "";
}

export async function loadCalibrations() {
  const listed = await askJson("calibrations");
  const known = new Map([...samples, ...listed.map((calibration) => [calibration.id, calibration])]);
  const serving = [...known.values()].filter((calibration) => calibration.revision);
  const choice = find("#calibration");
  const chosen = choice.value;
  choice.replaceChildren(choice.firstElementChild, ...serving.map(({ id }) => element("option", { value: id }, id)));
  choice.value = serving.some(({ id }) => id === chosen) ? chosen : "";
  change("calibrations", serving);
}

export const isServing = (id) => shared.calibrations.some((calibration) => calibration.id === id);

export function start(changed) {
  form().addEventListener("submit", (event) => event.preventDefault());
  form().addEventListener("input", () => {
    show();
    changed();
  });
  form().addEventListener("reset", () =>
    setTimeout(() => {
      show();
      changed();
    }),
  );
  show();
}
