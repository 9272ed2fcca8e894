/** Two lenses that both may be that of the camera, side by side: the one that straightens more of the room first. */

import { element, find, percent, plural } from "./dom.js";
import { differenceOf } from "./lens.js";

/**
 * The difference of the shares of straight edges from which on the better lens is told. In frames of rooms whose lens is
 * known, the right one was always the better, by .003 to .05.
 */
const CLEAR_SHARE = 0.02;
/** The error of a distance on the floor for an error of the radius at 45°: the tangent grows faster than the angle. */
const DISTANCE_FACTOR = Math.PI / 2;
/** The views of each lens. */
const VIEWS = 2;

/**
 * The found lenses, the better first, as they are chosen without the model of the camera: the deviation of each contains
 * the difference of both. `isClear` if the first one is clearly better.
 */
export function ranked(lenses) {
  const [better, other] = [...lenses].sort((one, another) => another.explained - one.explained);
  const isClear = !other || better.explained - other.explained >= CLEAR_SHARE;
  const doubt = isClear ? 0 : differenceOf(better.calibration.lens, other.calibration.lens);
  const chosen = [better, other].filter(Boolean).map((found) => withDoubt(found, doubt));
  return { chosen, isClear, doubt };
}

/** A found lens whose model was not given, with this deviation at least, percent of the radius. */
function withDoubt(found, doubt) {
  const { calibration } = found;
  const { lens } = calibration.sources;
  const sources = { ...calibration.sources, lens_model: { source: doubt ? "assumed" : "measured" }, lens: { ...lens, uncertainty: Math.max(lens.uncertainty, doubt) } };
  return { ...found, calibration: { ...calibration, sources } };
}

/** Removes the choice. */
export const clearChoice = () => find("#lens-choice").replaceChildren();

/** Shows the lenses; `viewsOf` returns the straightened views of a calibration, `use` gets the chosen lens. */
export async function showChoice(lenses, viewsOf, use) {
  const { chosen, isClear, doubt } = ranked(lenses);
  const views = await Promise.all(chosen.map(({ calibration }) => viewsOf(calibration)));
  const cards = chosen.map((found, index) => card(found, views[index].slice(0, VIEWS), use));
  find("#lens-choice").replaceChildren(
    element("h2", {}, "Do you know your camera's model?"),
    element("p", { class: "muted" }, "Its data sheet names the lens or “projection”: choose it under Known lens. Without it, compare: with the right lens, walls and doors are straight and upright."),
    element("p", { role: "status" }, isClear ? betterOf(chosen) : cannotTell(chosen, doubt)),
    element("div", { class: "lenses" }, ...cards),
  );
  find("#lens-choice").scrollIntoView({ block: "nearest" });
}

const shareOf = ({ explained, edges }) => `${percent(explained)} of ${plural(edges, "edge")} are straight`;
const nameOf = ({ calibration }) => calibration.lens.model;

function betterOf([better, other]) {
  return other ? `${nameOf(better)} fits this room better.` : `Only ${nameOf(better)} fits this room.`;
}

const cannotTell = ([better], doubt) =>
  `This frame cannot tell which: both straighten it. Of the two, ${nameOf(better)} is slightly better; distances on the floor may be wrong by ${Math.ceil(doubt * DISTANCE_FACTOR)} %.`;

function card(found, views, use) {
  const name = nameOf(found);
  for (const [index, view] of views.entries()) {
    view.setAttribute("role", "img");
    view.setAttribute("aria-label", `View ${index + 1} straightened as ${name}`);
  }
  const button = element("button", { type: "button", onclick: () => use(found) }, `Use ${name}`);
  return element("section", {}, element("h3", {}, name), ...views, element("p", { class: "muted" }, `${shareOf(found)}.`), button);
}
