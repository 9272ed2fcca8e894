/** The parameters of the section Detect, as in the API. */

import { element, find } from "./dom.js";
import { askJson } from "./server.js";
import { change, shared } from "./shared.js";

const SLIDERS = ["score_threshold", "iou_threshold", "sigma"];
/** The default refinements of profiles; `fusion` for all others. */
const OWN_REFINEMENT = { paper: "soft_nms_gaussian", direct: "nms" };

const form = () => find("#parameters");

/** The query of a request. Reports of the page are not stored, and inference is cached, because sliders send the same
 * frame again. */
export function query() {
  const given = [...new FormData(form())].filter(([, value]) => value !== "");
  return new URLSearchParams([...given, ["camera", "web-page"], ["store", "false"], ["cache", "true"]]);
}

export const profile = () => new FormData(form()).get("profile");

/** Shows the values, and disables those without effect. */
function show() {
  for (const name of SLIDERS) find(`output[for=${name}]`).textContent = Number(find(`#${name}`).value).toFixed(2);
  const refinement = find("#refine").value || OWN_REFINEMENT[profile()] || "fusion";
  find("#refine-own").textContent = `Default of the profile (${OWN_REFINEMENT[profile()] ?? "fusion"})`;
  find("#sigma").disabled = refinement !== "soft_nms_gaussian";
}

export async function loadCalibrations() {
  const all = await askJson("calibrations");
  const serving = all.filter((calibration) => calibration.revision);
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
