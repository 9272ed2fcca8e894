/** Finds lens, center and level of the frame's camera in straight edges, from what is known of the camera. */

import { element, find } from "./dom.js";
import { imagesOf } from "./live_frames.js";
import { shown, showFailure, withProgress } from "./progress.js";
import { askJson } from "./server.js";
import { shared, whenChanged } from "./shared.js";

/** The reasons of refusals that another search with a known model may avoid. */
const WANT_MODEL = ["ambiguous", "uncertain"];

/** The models of many ceiling cameras. */
const TRIED_MODELS = ["equisolid", "equidistant"];

const LABEL = "Finding the lens";

const field = (name) => find("#calibration-form").elements[name];
const host = () => find("#find-progress");

/** The query for what is known of the camera. */
function known() {
  const query = new URLSearchParams();
  if (field("knownLens").value) query.set("lens", field("knownLens").value);
  if (field("knownField").value) query.set("field_of_view_deg", field("knownField").value);
  if (field("knownPlace").value) query.set("ceiling", true);
  return query;
}

/** The body of a request: one image, or several in a form. */
function bodyOf(images) {
  if (images.length === 1) return images[0];
  const form = new FormData();
  for (const image of images) form.append("img", image, "frame.jpg");
  return form;
}

/** Removes what leads to the model of the lens. */
function clear() {
  find("#try-model")?.remove();
  field("knownLens").classList.remove("wanted");
}

/** Starts the search with its button. `nameOf` returns the name of the calibration, `show` gets it with the found lens. */
export function startFinding(nameOf, show) {
  let searching = null;

  /** Searches in these images of the frame's camera, or in new ones. */
  async function search(given = null) {
    if (!field("knownField").reportValidity()) return;
    searching?.abort();
    searching = new AbortController();
    const { signal } = searching;
    const { frame } = shared;
    const name = nameOf();
    clear();
    showFailure(host(), "");
    let images = given;
    const work = async (say) => {
      images ??= await imagesOf(frame, say, signal);
      say(LABEL);
      return askJson(`calibrations/${name}/fit?${known()}`, { method: "POST", body: bodyOf(images), signal });
    };
    const found = await withProgress(host(), LABEL, work).catch((problem) => {
      if (WANT_MODEL.includes(problem.refusal) && !field("knownLens").value) askForModel(images);
      throw problem;
    });
    if (shared.frame === frame) await show(name, found);
  }

  /** Leads to the model of the lens after a refusal without one. */
  function askForModel(images) {
    const repeat = (model) => () => {
      field("knownLens").value = model;
      find("#find-lens").focus();
      return search(images);
    };
    const tries = TRIED_MODELS.map((model) => element("button", { type: "button", onclick: shown(repeat(model)) }, `Try ${model}`));
    host().append(element("span", { id: "try-model" }, ...tries));
    field("knownLens").classList.add("wanted");
    if ([document.body, find("#find-lens")].includes(document.activeElement)) field("knownLens").focus();
  }

  find("#find-lens").addEventListener("click", shown(() => search()));
  field("knownLens").addEventListener("change", clear);
  whenChanged(["frame"], () => {
    searching?.abort();
    clear();
    showFailure(host(), "");
  });
}
