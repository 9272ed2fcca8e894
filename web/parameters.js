/** The parameters of the section Detect, as the server takes them. */

import { element, find } from "./dom.js";
import { askJson } from "./server.js";
import { change, shared } from "./shared.js";

const SLIDERS = ["score_threshold", "iou_threshold", "sigma"];
/** What refines where nothing is chosen. */
const OWN_REFINEMENT = { paper: "soft_nms_gaussian", direct: "nms" };

const form = () => find("#parameters");

/** As a query. Reports of the page are kept under a name of its own, not among those of a camera; and as whoever
 * moves a slider asks for the same frame again, what the network found in it is to be remembered. */
export function query() {
  const given = [...new FormData(form())].filter(([, value]) => value !== "");
  return new URLSearchParams([...given, ["camera", "web-page"], ["remember", "true"]]);
}

export const profile = () => new FormData(form()).get("profile");

/** Shows the values, and which of them matter. */
function show() {
  for (const name of SLIDERS) find(`output[for=${name}]`).textContent = Number(find(`#${name}`).value).toFixed(2);
  const refinement = find("#refine").value || OWN_REFINEMENT[profile()] || "fusion";
  find("#refine-own").textContent = `The profile's own (${OWN_REFINEMENT[profile()] ?? "fusion"})`;
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
  form().addEventListener("reset", () => setTimeout(() => (show(), changed())));
  show();
}
