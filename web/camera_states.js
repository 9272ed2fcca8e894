/** The cameras that this server reads: their states and settings, if the server reads any. */

import { find } from "./dom.js";
import { askJson } from "./server.js";

/** The interval between two updates. */
const MILLIS = 3000;

let asked = null;

/** What the server has and what the key permits. A failure permits nothing. */
export function options() {
  asked ??= askJson("assets/options.json").catch(() => ({}));
  return asked;
}

/** Passes the states to `show` until `signal` aborts. Returns a function that reads them at once. */
export function followStates(show, signal) {
  asked = null;
  const read = async () => {
    const { has_cameras: reads, can_change: may } = await options();
    find("#add-camera").hidden = !(reads && may);
    if (!reads) return;
    const rows = await askJson("cameras", { signal }).catch(() => null);
    if (rows && !signal.aborted) show(rows);
  };
  const follow = async () => {
    while (!signal.aborted) {
      await read();
      await new Promise((resolve) => setTimeout(resolve, MILLIS));
    }
  };
  follow();
  return read;
}
