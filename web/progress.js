/** Shows what takes long, and what went wrong. */

import { element, find } from "./dom.js";

/** Work that takes longer is shown. */
const PATIENCE_MILLIS = 300;

/** Does `work` and shows a bar in `host` for as long as it takes; failures are told there, too. */
export async function withProgress(host, label, work) {
  const began = performance.now();
  const seconds = element("span", { class: "seconds", "aria-hidden": "true" });
  const bar = element(
    "div",
    { class: "progress" },
    element("progress", { "aria-label": label }),
    element("span", {}, label, " "),
    seconds,
  );
  const tick = () => {
    seconds.textContent = `${((performance.now() - began) / 1000).toFixed(1)} s`;
  };
  let ticking;
  const waiting = setTimeout(() => {
    host.append(bar);
    tick();
    ticking = setInterval(tick, 100);
  }, PATIENCE_MILLIS);
  host.setAttribute("aria-busy", "true");
  try {
    const done = await work();
    tell(host, "");
    return done;
  } catch (error) {
    if (error.name !== "AbortError") tell(host, error.message);
    throw error;
  } finally {
    clearTimeout(waiting);
    clearInterval(ticking);
    bar.remove();
    host.removeAttribute("aria-busy");
  }
}

/** Shows a failure in `host`, or takes the last one away. */
export function tell(host, text) {
  find(":scope > .failure", host)?.remove();
  if (text) host.append(element("p", { class: "failure", role: "alert" }, text));
}

/** For event handlers: what went wrong has been shown. */
export function shown(work) {
  return (...given) => {
    work(...given).catch((error) => {
      if (error.name !== "AbortError" && error.status === undefined) throw error;
    });
  };
}
