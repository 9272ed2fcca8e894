/** The same views straightened twice, before and after a lens was found, with one movable divider for all. */

import { element, find } from "./dom.js";

/** Shows the views; those with a view before over each other. */
export function showViews(after, before) {
  find("#divider").hidden = !before.length;
  find("#previews").replaceChildren(...after.map((canvas, index) => labelled(canvas, before[index], index + 1)));
}

function labelled(after, before, number) {
  if (!before) {
    after.setAttribute("role", "img");
    after.setAttribute("aria-label", `Straightened view ${number}`);
    return after;
  }
  after.classList.add("after");
  return element("div", { class: "compared", role: "img", "aria-label": `Straightened view ${number}, before and after` }, before, after);
}

/** Starts the divider. */
export function startDivider() {
  const place = find("#divider-place");
  place.addEventListener("input", () => find("#previews").style.setProperty("--divider", `${place.value}%`));
}
