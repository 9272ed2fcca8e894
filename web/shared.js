/** What the sections share; whoever wants to know hears of changes. */

export const shared = {
  /** The frame: `{blob, name, url, width, height, pixels}`. */
  frame: null,
  /** Its report, as the server answered it. */
  report: null,
  /** The index of the person that is pointed out, or null. */
  person: null,
  /** The calibrations that serve. */
  calibrations: [],
};

export function change(name, value) {
  shared[name] = value;
  document.dispatchEvent(new Event(`changed-${name}`));
}

export function whenChanged(names, act) {
  for (const name of names) document.addEventListener(`changed-${name}`, act);
}
