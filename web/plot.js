/** Persons over time as a step plot: a count is valid until the next report. A number that is not known is null. Time with too few frames is marked. */

import { plural, shape } from "./dom.js";
import { roundStep } from "./geometry.js";

const [WIDTH, HEIGHT, LEFT, BOTTOM, TOP] = [320, 110, 24, 20, 8];

const clock = (time) => new Date(time).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit" });

/** Draws `history` until `now`: at least one `{time, persons, slow}`, milliseconds since 1970, oldest first. */
export function stepPlot(history, now) {
  const first = history[0].time;
  // The clocks of the server and of this machine may differ.
  const last = Math.max(now, history.at(-1).time);
  const most = Math.max(1, ...history.map(({ persons }) => persons ?? 0));
  const step = Math.max(1, roundStep(most, 3));
  const top = Math.ceil(most / step) * step;
  const x = (time) => LEFT + ((time - first) / Math.max(1, last - first)) * (WIDTH - LEFT - 2);
  const y = (persons) => TOP + (1 - persons / top) * (HEIGHT - TOP - BOTTOM);
  const slow = history.flatMap(({ time, slow }, index) => (slow ? [[x(time), x(history[index + 1]?.time ?? last)]] : []));
  const ended = [...history, { time: last, persons: history.at(-1).persons }];
  const below = steps(ended.map(({ time, persons }) => ({ time, persons: persons ?? 0 })), x, y);
  const ticks = Array.from({ length: top / step + 1 }, (_, index) => index * step);
  const count = history.at(-1).persons;
  const label = `Persons over time: ${count === null ? "not known" : plural(count, "person")} now, at most ${most} since ${clock(first)}`;
  return shape(
    "svg",
    { class: "plot", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": label },
    ...slow.map(([from, to]) => shape("rect", { class: "too-low", x: from, y: TOP, width: to - from, height: HEIGHT - TOP - BOTTOM }, shape("title", {}, "Too few frames: crossings may be missed"))),
    ...ticks.map((tick) => shape("path", { class: "grid", d: `M${LEFT} ${y(tick)}H${WIDTH}` })),
    ...ticks.map((tick) => shape("text", { x: LEFT - 6, y: y(tick) + 4, "text-anchor": "end" }, String(tick))),
    shape("path", { class: "area", d: `${below}V${y(0)}H${x(first)}Z` }),
    shape("path", { class: "steps", d: steps(ended, x, y) }),
    ...(count === null ? [] : [shape("circle", { class: "now", cx: x(last), cy: y(count), r: 3 })]),
    shape("text", { x: LEFT, y: HEIGHT - 3 }, clock(first)),
    shape("text", { x: WIDTH - 2, y: HEIGHT - 3, "text-anchor": "end" }, last > first ? clock(last) : ""),
  );
}

/** The path of the steps, with a gap where the number is not known. */
export function steps(history, x, y) {
  let path = "";
  let before = null;
  for (const { time, persons } of history) {
    const at = x(time).toFixed(1);
    if (before !== null) path += `H${at}`;
    if (persons !== null) path += before === null ? `M${at} ${y(persons).toFixed(1)}` : `V${y(persons).toFixed(1)}`;
    before = persons;
  }
  return path;
}

/** The history of the steps of a camera's counts from the first known number on: the mean number of each. */
export function countedNumbers(counted) {
  const history = [];
  for (const { from, persons, slow_seconds: slowSeconds } of counted) {
    const number = persons ? Math.round(persons.mean) : null;
    const slow = slowSeconds > 0;
    const last = history.at(-1);
    if (last ? last.persons !== number || last.slow !== slow : number !== null) history.push({ time: Date.parse(from), persons: number, slow });
  }
  return history;
}
