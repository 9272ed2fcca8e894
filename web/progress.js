/** Shows what takes long, and what went wrong. */

import { element, find } from "./dom.js";

/** Work that takes longer is shown. */
const PATIENCE_MILLIS = 300;

/** How much is under way in a host: what was replaced ends after what replaces it has begun. */
const underWay = new WeakMap();

function count(host, change) {
  const now = (underWay.get(host) ?? 0) + change;
  underWay.set(host, now);
  if (now) host.setAttribute("aria-busy", "true");
  else host.removeAttribute("aria-busy");
}

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
  count(host, 1);
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
    count(host, -1);
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
