/** The cameras that this server reads: their states and settings, if the server reads any. */

import { find, plural } from "./dom.js";
import { askJson } from "./server.js";

/** The interval between two updates. */
const MILLIS = 3000;

let asked = null;

/** What the server has and what the key permits. A failure permits nothing. */
export function options() {
  asked ??= askJson("assets/options.json").catch(() => ({}));
  return asked;
}

/** Says for how long a kept image stays. */
export async function retention() {
  const { image_age_seconds: seconds = 86_400 } = await options();
  const age = seconds < 3600 ? plural(Math.round(seconds / 60), "minute") : plural(Math.round(seconds / 3600), "hour");
  return `Images show people to everyone who may read results. The next frame replaces the image; without one, it is deleted after ${age}.`;
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
