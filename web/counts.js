/** Counts in the section Cameras, if the server has them: tracks, lines, zones, heat maps. */

import { countRows, drawCounts } from "./counts_drawing.js";
import { element, find, shape } from "./dom.js";
import { options } from "./camera_states.js";
import { floorAlerts } from "./floor_alerts.js";
import { furnitureList } from "./furniture.js";
import { key } from "./server.js";

/** The interval between two updates of the tracks. */
const TRACKS_MILLIS = 1000;
/** The number of updates after which the list of cameras is loaded again. */
const UPDATES_PER_LIST = 10;
/** The pause after a failure. */
const PAUSE_MILLIS = 5000;
/** The age at which a heat map is loaded again. */
const HEAT_MILLIS = 60_000;

/** The shown cards by camera. */
const cards = new Map();
/** The drawings by camera: `{drawing, rows, furniture, floor, heat, heatAt}`. */
const counted = new Map();
let polling = null;
const PATH = "counts";
let bar;

/** A response that is not an answer of `lookdown count`. */
class Unreachable extends Error {}

/** Starts or ends the updates. */
export function followCounts(is) {
  polling?.abort();
  polling = null;
  if (!is) return;
  polling = new AbortController();
  poll(polling.signal);
}

/** Adds the counts of a camera to its card, after each drawing of the card. */
export function addCounts(card) {
  cards.set(card.camera, card);
  if (counted.has(card.camera)) attach(card);
}

/** The layers that the server draws into the image of a camera: none below the counts. */
export const layersBelow = ({ camera }) => (counted.has(camera) ? "none" : "oriented,zones");

async function poll(signal) {
  const { has_counts: hasCounts } = await options();
  if (!hasCounts) return;
  bar ??= controls();
  while (!signal.aborted) {
    try {
      const rows = await json("", signal);
      if (!Array.isArray(rows)) throw new Unreachable();
      report("");
      for (let update = 0; update < UPDATES_PER_LIST && !signal.aborted; update += 1) {
        for (const { name, too_low_since: since } of rows) if (cards.has(name)) cards.get(name).isTooLow = Boolean(since);
        const shown = rows.map(({ name }) => name).filter((name) => cards.get(name)?.node.isConnected);
        await Promise.all(shown.map((camera) => load(camera, signal)));
        await pause(TRACKS_MILLIS, signal);
      }
    } catch {
      if (signal.aborted) return;
      report("The counts cannot be read: the log of the server has the reason.");
      for (const camera of [...counted.keys()]) remove(camera);
      await pause(PAUSE_MILLIS, signal);
    }
  }
}

/** The switch of the heat map and the place of the message, above the cards. */
function controls() {
  const onchange = () => {
    for (const camera of counted.keys()) refresh(camera);
  };
  const heat = element("input", { type: "checkbox", id: "heat", onchange });
  const node = element("div", { id: "counts-bar" }, element("label", { for: "heat" }, heat, " Heat map"), element("p", { class: "muted", role: "status" }));
  find("#add-camera").before(node);
  return { node, heat, message: find("p", node) };
}

function report(message) {
  if (bar.message.textContent !== message) bar.message.textContent = message;
  bar.heat.parentElement.hidden = message !== "";
}

/** Loads the tracks of a camera and draws them; removes the drawing of a camera without counts. */
async function load(camera, signal) {
  const answer = await json(`/${encodeURIComponent(camera)}/tracks`, signal, [404]);
  if (!answer) return remove(camera);
  if (!counted.has(camera)) {
    const drawing = shape("svg", { class: "counts", role: "img" });
    counted.set(camera, { drawing, rows: element("ul", { class: "count-rows" }), furniture: furnitureList(camera), floor: floorAlerts(camera), answer, heat: "", heatAt: 0 });
    attach(cards.get(camera));
  }
  counted.get(camera).answer = answer;
  await refresh(camera, signal);
}

/** Draws the last answer, and loads the heat map if it is shown and old. */
async function refresh(camera, signal = polling?.signal) {
  const counts = counted.get(camera);
  if (bar.heat.checked && Date.now() - counts.heatAt > HEAT_MILLIS) {
    counts.heatAt = Date.now();
    const response = await request(`/${encodeURIComponent(camera)}/heatmap-frame.png`, signal).catch(() => null);
    if (response?.ok) {
      URL.revokeObjectURL(counts.heat);
      counts.heat = URL.createObjectURL(await response.blob());
    }
  }
  const card = cards.get(camera);
  counts.floor.show(counts.answer.floor_alerts, card?.node);
  if (!card?.report || !counted.has(camera)) return;
  const { width, height } = card.report.image;
  drawCounts(counts.drawing, { camera, width, height, heat: bar.heat.checked ? counts.heat : "" }, counts.answer);
  counts.rows.replaceChildren(...countRows(counts.answer, card.isSingle ? card.today : null));
  counts.furniture.show(counts.answer.furniture);
}

function attach(card) {
  const { drawing, rows, furniture, floor } = counted.get(card.camera);
  card.node.classList.add("counted");
  const sight = find(".sight", card.node);
  sight.append(drawing);
  sight.before(floor.node);
  sight.after(rows, furniture.node);
}

function remove(camera) {
  const counts = counted.get(camera);
  if (!counts) return;
  counted.delete(camera);
  URL.revokeObjectURL(counts.heat);
  counts.drawing.remove();
  counts.rows.remove();
  counts.furniture.node.remove();
  counts.floor.node.remove();
  cards.get(camera)?.node.classList.remove("counted", "has-floor-alert");
}

async function request(address, signal) {
  const headers = key.get() ? { "X-API-Key": key.get() } : {};
  return fetch(`${PATH}${address}`, { headers, signal });
}

/** The JSON of an address below the path; null for the statuses `without`. */
async function json(address, signal, without = []) {
  const response = await request(address, signal);
  if (without.includes(response.status)) return null;
  if (!response.ok) throw Object.assign(new Unreachable(), { status: response.status });
  return response.json();
}

/** Waits for a time, or until `signal` aborts. */
const pause = (millis, signal) =>
  new Promise((resolve) => {
    const timer = setTimeout(resolve, millis);
    const stop = () => {
      clearTimeout(timer);
      resolve();
    };
    signal.addEventListener("abort", stop, { once: true });
  });
