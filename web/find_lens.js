/** Finds lens, center and level of the frame's camera in straight edges, from what is known of the camera. */

import { find } from "./dom.js";
import { clearChoice, showChoice } from "./lens_choice.js";
import { imagesOf } from "./live_frames.js";
import { shown, showFailure, withProgress } from "./progress.js";
import { askJson } from "./server.js";
import { shared, whenChanged } from "./shared.js";

/** The reasons of refusals that another search with a known model may avoid. */
export const WANT_MODEL = ["ambiguous", "uncertain"];

/** The models of many ceiling cameras. */
const TRIED_MODELS = ["equisolid", "equidistant"];

const LABEL = "Finding the lens";

const field = (name) => find("#calibration-form").elements[name];
const host = () => find("#find-progress");

/** The query for what is known of the camera, or for another lens. */
function known(lens = field("knownLens").value) {
  const query = new URLSearchParams();
  if (lens) query.set("lens", lens);
  if (field("knownField").value) query.set("field_of_view_deg", field("knownField").value);
  if (field("knownPlace").value) query.set("ceiling", true);
  return query;
}

/** Returns null for a lens that the edges refuse; throws any other problem. */
function passOver(problem) {
  if (problem.refusal) return null;
  throw problem;
}

/** The body of a request: one image, or several in a form. */
function bodyOf(images) {
  if (images.length === 1) return images[0];
  const form = new FormData();
  for (const image of images) form.append("img", image, "frame.jpg");
  return form;
}

/**
 * Starts the search with its button. `nameOf` returns the name of the calibration, `show` gets it with the found lens, and
 * `viewsOf` returns the straightened views of a calibration.
 */
export function startFinding(nameOf, show, viewsOf) {
  let searching = null;

  /** Searches in the images of the frame's camera. */
  async function search() {
    if (!field("knownField").reportValidity()) return;
    searching?.abort();
    searching = new AbortController();
    const { signal } = searching;
    const { frame } = shared;
    const name = nameOf();
    clearChoice();
    showFailure(host(), "");
    const work = async (say) => {
      const images = await imagesOf(frame, say, signal);
      const fit = (query) => askJson(`calibrations/${name}/fit?${query}`, { method: "POST", body: bodyOf(images), signal });
      say(LABEL);
      try {
        return [await fit(known())];
      } catch (problem) {
        if (!WANT_MODEL.includes(problem.refusal) || field("knownLens").value) throw problem;
        const lenses = [];
        for (const model of TRIED_MODELS) {
          say(`Comparing lenses, ${model}`);
          lenses.push(await fit(known(model)).catch(passOver));
        }
        if (!lenses.some(Boolean)) throw problem;
        return lenses;
      }
    };
    const lenses = await withProgress(host(), LABEL, work);
    if (shared.frame !== frame) return;
    if (lenses.length === 1) await show(name, lenses[0]);
    else await showChoice(lenses.filter(Boolean), (file) => viewsOf(file, signal), shown(choose(name)));
  }

  /** Takes a lens of the choice. */
  const choose = (name) => async (found) => {
    clearChoice();
    await show(name, found);
    find("#save").focus();
  };

  find("#find-lens").addEventListener("click", shown(search));
  field("knownLens").addEventListener("change", clearChoice);
  whenChanged(["frame"], () => {
    searching?.abort();
    clearChoice();
    showFailure(host(), "");
  });
}
