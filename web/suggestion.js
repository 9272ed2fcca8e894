/** The notice about the calibration that the server looks for in the frames of a camera: its values, a look at the views
 * and use at once, or the reason why there is none. */

import { openFound } from "./calibrate.js";
import { options } from "./camera_states.js";
import { element } from "./dom.js";
import { WANT_MODEL } from "./find_lens.js";
import { loadCalibrations } from "./parameters.js";
import { shown, withProgress } from "./progress.js";
import { ask, askJson } from "./server.js";
import { useFrame } from "./use_frame.js";

/** The interval between two questions for the same suggestion. */
const AGE_MILLIS = 20_000;

/** Shows the suggested calibration of a card, or the reason why there is none; removes the notice of a camera that needs none. */
export async function showSuggestion(card) {
  const { camera, info, suggestion } = card;
  if (!["found", "refused"].includes(info?.suggestion)) {
    Object.assign(card, { suggestedAt: 0, suggested: "" });
    suggestion.replaceChildren();
    return;
  }
  if (Date.now() - card.suggestedAt < AGE_MILLIS) return;
  card.suggestedAt = Date.now();
  const answer = await askJson(`cameras/${encodeURIComponent(camera)}/suggested-calibration`).catch(() => null);
  const text = answer?.calibration ? textOf(answer) : refusalOf(answer);
  if (text === card.suggested) return;
  card.suggested = text;
  suggestion.replaceChildren(...(text ? await notice(card, answer, text) : []));
}

/** The reason why no lens was found, with what to do; empty while the server looks for one. */
function refusalOf(answer) {
  if (answer?.state !== "refused" || !answer.lens_refusal) return "";
  const { reason, detail } = answer.lens_refusal;
  const remedy = WANT_MODEL.includes(reason) ? "Calibrate compares the usual lenses: do you know your camera's model?" : `${detail[0].toUpperCase()}${detail.slice(1)}.`;
  return `No calibration was found. ${remedy}`;
}

function textOf({ lens, height, frames, frames_wanted: wanted }) {
  const above = height ? `${height.height_m.toFixed(2)} m above the floor (± ${height.height_sd_m.toFixed(2)} m, from its people)` : "";
  if (!lens) return `The camera is ${above}.`;
  const angles = `${lens.field_of_view_deg.toFixed(0)}° field of view, tilted by ${lens.tilt_deg.toFixed(1)}°`;
  return `A calibration was found in ${frames} of ${wanted} frames: ${[angles, above].filter(Boolean).join(", ")}.`;
}

async function notice(card, found, text) {
  const { can_change: may } = await options();
  const look = async () => {
    await useFrame(card, "calibrate");
    await openFound({ calibration: found.calibration, ...found.lens });
  };
  const use = async () => {
    const headers = found.replaces ? { "If-Match": `"${found.replaces}"` } : { "If-None-Match": "*" };
    await ask(`calibrations/${found.calibration.id}`, { method: "PUT", body: JSON.stringify(found.calibration), headers });
    card.suggested = "";
    card.suggestion.replaceChildren(element("p", { role: "status" }, `${found.calibration.id} is saved and in use.`));
    await loadCalibrations();
  };
  const act = (label, work) => shown(() => withProgress(card.strip, label, work));
  const button = (label, onclick) => element("button", { type: "button", onclick }, label);
  if (!found.calibration) return [element("p", {}, text), button("Calibrate", act("Reading the frame", () => useFrame(card, "calibrate")))];
  return [
    element("p", {}, text),
    found.lens ? button("Look", act("Reading the frame", look)) : "",
    may ? button("Apply", act("Saving", use)) : "",
  ];
}
