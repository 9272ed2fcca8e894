/** The numbers of a camera's day: most persons in each hour, and the crossings. */

import { element, plural, shape } from "./dom.js";
import { askJson } from "./server.js";
import { options } from "./camera_states.js";

/** The age at which the numbers are loaded again. */
const MILLIS = 60_000;
const HOUR = 3_600_000;
const [WIDTH, HEIGHT, BOTTOM, TOP] = [320, 84, 18, 6];

/** Shows the day of a card that fills the page, if the server counts. */
export async function showDay(card) {
  drawDay(card);
  if (!card.isSingle || Date.now() - (card.dayAt ?? 0) < MILLIS) return;
  card.dayAt = Date.now();
  const { has_counts: hasCounts } = await options();
  if (!hasCounts) return;
  const today = (step) => askJson(`counts/${encodeURIComponent(card.camera)}?${new URLSearchParams({ from: "today", step })}`).catch(() => null);
  card.dayCounts = await today("1h");
  card.today = (await today("168h"))?.steps[0];
  drawDay(card);
  await card.crossings.refresh();
}

/** Draws the day. Its most persons are those of the plot as well, which has newer numbers. */
function drawDay(card) {
  card.day.hidden = !card.isSingle || !card.dayCounts;
  card.day.replaceChildren(...(card.day.hidden ? [] : drawn(card.dayCounts, card.history)));
}

function drawn({ from, steps }, history) {
  const today = history.filter(({ time }) => time >= Date.parse(from));
  const most = Math.max(0, ...steps.map(({ persons }) => persons?.max ?? 0), ...today.map(({ persons }) => persons ?? 0));
  const text = steps.some(({ persons }) => persons) ? `Today: at most ${plural(most, "person")} at once` : "Today: nothing is counted yet";
  return [element("h2", {}, text), bars(Date.parse(from), steps, most)];
}

/** The hour of a time by the clock. A day on which the clock changes has 23 or 25 hours, two of them with one number. */
export function hourOf(time, midnight) {
  const isOwnZone = new Date(midnight).getHours() === 0;
  return isOwnZone ? new Date(time).getHours() : Math.min(23, (time - midnight) / HOUR);
}

/** Bars over 24 hours: the most persons at once in each hour. An hour without reports has none. */
function bars(midnight, steps, most) {
  const x = (time) => (hourOf(time, midnight) / 24) * WIDTH;
  const height = (count) => (count / Math.max(1, most)) * (HEIGHT - TOP - BOTTOM);
  const base = HEIGHT - BOTTOM;
  const known = steps.filter(({ persons }) => persons);
  const bar = ({ from, persons: { max } }) => shape("rect", { x: x(Date.parse(from)) + 1, y: base - height(max), width: WIDTH / 24 - 2, height: height(max) });
  const hours = [0, 6, 12, 18, 24];
  return shape(
    "svg",
    { class: "plot hours", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": `Most persons at once in each hour of today, at most ${most}` },
    shape("path", { class: "grid", d: `M0 ${base}H${WIDTH}` }),
    ...known.map(bar),
    ...hours.map((hour) => shape("text", { x: (hour / 24) * WIDTH, y: HEIGHT - 3, "text-anchor": hour === 0 ? "start" : hour === 24 ? "end" : "middle" }, `${hour}:00`)),
  );
}
