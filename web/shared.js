/** The shared state of the sections, with change events. */

export const shared = {
  /** The frame: `{blob, name, camera, read, url, width, height, pixels}`. */
  frame: null,
  /** Its report, as returned by the server. */
  report: null,
  /** The index of the highlighted person, or null. */
  person: null,
  /** The calibrations in use. */
  calibrations: [],
};

export function change(name, value) {
  shared[name] = value;
  document.dispatchEvent(new Event(`changed-${name}`));
}

export function whenChanged(names, act) {
  for (const name of names) document.addEventListener(`changed-${name}`, act);
}
