/** Shows progress bars and failures. */

import { element, find } from "./dom.js";

/** The delay before a progress bar is shown. */
const PATIENCE_MILLIS = 300;

/** The number of running operations per host: a replaced one may end after its replacement has begun. */
const underWay = new WeakMap();

function count(host, change) {
  const now = (underWay.get(host) ?? 0) + change;
  underWay.set(host, now);
  if (now) host.setAttribute("aria-busy", "true");
  else host.removeAttribute("aria-busy");
}

/** Runs `work`, with a progress bar in `host`; shows failures there, too. `work` may change the label. */
export async function withProgress(host, label, work) {
  const began = performance.now();
  const seconds = element("span", { class: "seconds", "aria-hidden": "true" });
  const meter = element("progress");
  const words = element("span");
  const bar = element("div", { class: "progress" }, meter, words, seconds);
  const say = (text) => {
    meter.setAttribute("aria-label", text);
    words.textContent = `${text} `;
  };
  say(label);
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
    const done = await work(say);
    showFailure(host, "");
    return done;
  } catch (error) {
    if (error.name !== "AbortError") showFailure(host, error.message);
    throw error;
  } finally {
    clearTimeout(waiting);
    clearInterval(ticking);
    bar.remove();
    count(host, -1);
  }
}

/** Shows a failure in `host`, or removes it if `text` is empty. */
export function showFailure(host, text) {
  find(":scope > .failure", host)?.remove();
  if (text) host.append(element("p", { class: "failure", role: "alert" }, text));
}

/** Wraps an event handler: ignores failures that are already shown. */
export function shown(work) {
  return (...given) => {
    work(...given).catch((error) => {
      if (error.name !== "AbortError" && error.status === undefined) throw error;
    });
  };
}
