/** Drawings of `lookdown count` over a frame: tracks with their tails, lines, zones and the heat map. */

import { element, plural, shape } from "./dom.js";
import { points } from "./geometry.js";

/** The number of colors of tracks (counts.css). */
const COLORS = 6;
/** The number of colors of lines (counts.css). */
const LINE_COLORS = 4;
/** The share of the frame's width that 1 unit of a drawing has. */
const UNIT = 1 / 320;
/** Arrows in steps of 45°, clockwise from the right. */
const ARROWS = ["→", "↘", "↓", "↙", "←", "↖", "↑", "↗"];

/** Draws an answer over the frame of a camera. `heat` is the address of its heat map, empty for none. */
export function drawCounts(drawing, { camera, width, height, heat }, { tracks, lines = [], zones = [], furniture = [] }) {
  const unit = width * UNIT;
  drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
  drawing.setAttribute("aria-label", `${plural(tracks.length, "track")} of ${camera}`);
  drawing.replaceChildren(
    ...(heat ? [shape("image", { href: heat, width, height })] : []),
    ...zones.filter(hasOutline).map(({ outline_px: outline }) => shape("polygon", { class: "count-zone", points: points(outline), "stroke-width": unit })),
    ...furniture.filter(isFurniture).map(({ id, outline_px: outline }) => shape("polygon", { class: "count-furniture", "data-thing": id, points: points(outline), "stroke-width": unit, "stroke-dasharray": 3 * unit })),
    ...lines.flatMap((line, index) => (hasOutline(line) ? drawnLine(line, unit, index) : [])),
    ...tracks.filter(({ frame_px: place }) => place).map((track) => drawnTrack(track, unit)),
  );
}

const isFurniture = ({ state }) => state !== "candidate";
const hasOutline = ({ outline_px: outline }) => outline?.length > 1;

/** A line with its name, and an arrow in its first direction. */
function drawnLine({ line, outline_px: outline }, unit, index) {
  const [x, y] = outline[Math.floor(outline.length / 2)];
  const [x2, y2] = outline.at(-1);
  const degrees = turnOf(outline);
  const color = `line-${index % LINE_COLORS}`;
  const arrow = `M0 ${-5 * unit}L${9 * unit} 0L0 ${5 * unit}Z`;
  return [
    shape("polyline", { class: `count-line ${color}`, points: points(outline), "stroke-width": 2.5 * unit }),
    shape("path", { class: `count-arrow ${color}`, d: arrow, transform: `translate(${x} ${y}) rotate(${degrees})` }),
    shape("text", { class: "count-name", x: x2, y: y2, "font-size": 11 * unit, "stroke-width": 3 * unit, "text-anchor": "middle" }, line),
  ];
}

/** The first direction across a line, degrees clockwise from the right. */
const turnOf = ([[x1, y1], ...rest]) => (Math.atan2(rest.at(-1)[0] - x1, y1 - rest.at(-1)[1]) * 180) / Math.PI;

function drawnTrack({ id, frame_px: [x, y], tail_px: tail }, unit) {
  return shape(
    "g",
    { class: `track color-${id % COLORS}`, "data-track": id },
    shape("polyline", { points: points(tail), "stroke-width": 2.5 * unit }),
    shape("circle", { cx: x, cy: y, r: 4.5 * unit, "stroke-width": unit }),
  );
}

/** The rows of lines with their crossings, also those of `today`, with their error bars, and of zones with their persons. */
export function countRows({ lines = [], zones = [] }, today = null) {
  const ofLine = ({ line, directions, crossings, outline_px: outline }, index) => {
    const arrows = arrowsOf(outline);
    const ofToday = (direction) => {
      const [count, low, high] = ["estimated", "low", "high"].map((end) => today?.[`lines_${end}`]?.[line]?.[direction]);
      return Number.isInteger(count) ? ` (today ${count}, in 9 of 10 cases ${low} to ${high})` : "";
    };
    const parts = directions.map((direction, side) => [number(crossings[direction]), ` ${arrows[side]} ${direction}${ofToday(direction)}${side === 0 ? ", " : ""}`]);
    return row(`line line-${index % LINE_COLORS}`, line, ...parts.flat());
  };
  const ofZone = ({ zone, persons, entries }) => row("zone", zone, number(persons ?? "?"), " now, ", number(entries), " entered");
  return [...lines.map(ofLine), ...zones.map(ofZone)];
}

/** The arrows of both directions of a line, as they are drawn. */
export function arrowsOf(outline) {
  const eighth = outline?.length > 1 ? Math.round(turnOf(outline) / 45) : 0;
  return [ARROWS[(eighth + 8) % 8], ARROWS[(eighth + 12) % 8]];
}

const row = (kind, name, ...counts) => element("li", { class: `of-${kind}` }, element("span", { class: "count-of" }, name), element("span", {}, ...counts));
const number = (count) => element("b", {}, String(count));
