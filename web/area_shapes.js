/** Draws areas with their names, the handles of the selected one, and the outline that is being drawn. */

import { shape } from "./dom.js";
import { points } from "./geometry.js";
import { middles, titleOf } from "./areas.js";

/** The height of a caption, pixels of the screen. */
const CAPTION_HEIGHT = 16;

const capital = (text) => text[0].toUpperCase() + text.slice(1);

/**
 * Draws into `drawing`. `unit` is a pixel of the screen in drawing units; `countOf` returns the text of a zone's
 * count; `invalid` is the key of the area that the server refused.
 */
export function drawAreas(drawing, { editor, surface, report, unit, countOf, invalid }) {
  const focused = drawing.contains(document.activeElement) ? document.activeElement.dataset.node : null;
  const { selected, draft } = editor;
  const shownAreas = editor.areas.filter(({ space }) => space === surface.space);
  // Those on the floor are seen over the frame, too.
  const floorAreas = editor.areas.filter(({ space }) => surface.outlineOnFloor && space === "floor_m");
  // The selected area is above the others.
  shownAreas.sort((one, other) => Number(one.key === selected?.key) - Number(other.key === selected?.key));
  drawing.setAttribute("viewBox", surface.viewBox.join(" "));
  drawing.classList.toggle("is-drawing", Boolean(draft));
  const context = { editor, surface, unit, countOf, invalid };
  const projected = floorAreas.map((area) => ({ area, places: surface.outlineOnFloor(area) ?? [] })).filter(({ places }) => places.length > 1);
  const current = selected && shownAreas.find(({ key }) => key === selected.key);
  drawing.replaceChildren(
    shape("g", { class: "backdrop", "aria-hidden": "true" }, ...surface.backdrop(report, unit)),
    ...projected.map((fixed) => fixedShape(fixed, unit)),
    ...shownAreas.map((area) => areaShape(area, context)),
    ...apart([...projected.flatMap(({ area, places }) => nameCaption(area, context, places)), ...shownAreas.flatMap((area) => captions(area, context))], unit),
    ...(current ? handles(current, context) : []),
    ...(draft ? draftShapes(draft, context) : []),
  );
  if (focused) (drawing.querySelector(`[data-node="${focused}"]`) ?? drawing).focus({ preventScroll: true });
}

/** An area of the other surface, which is not edited here. */
function fixedShape({ area: { kind }, places }, unit) {
  const part = (name, width) => shape(kind === "line" ? "polyline" : "polygon", { points: points(places), class: name, "stroke-width": width * unit });
  return shape("g", { class: `area fixed ${kind}`, "data-kind": kind, "aria-hidden": "true" }, part("casing", 4.5), part("outline", 2));
}

function areaShape(area, { editor, surface, unit, countOf, invalid }) {
  const isSelected = editor.selected?.key === area.key;
  const outline = points(area.corners.map(surface.toDrawing));
  const name = area.kind === "line" ? "polyline" : "polygon";
  const facts = [capital(titleOf(area, editor.areas)), countOf(area)].filter(Boolean).join(", ");
  const part = (kind, width) => shape(name, { points: outline, class: kind, "stroke-width": width * unit });
  return shape(
    "g",
    {
      class: `area ${area.kind}${isSelected ? " selected" : ""}${invalid === area.key ? " invalid" : ""}`,
      "data-node": `area-${area.key}`, "data-key": area.key, "data-kind": area.kind,
      tabindex: 0, role: "button", "aria-pressed": String(isSelected), "aria-label": facts,
    },
    part("hit", 22),
    part("casing", 4.5),
    part("outline", isSelected ? 2.8 : 2),
  );
}

/** The middle of the corners. */
const middleOf = (places) => [0, 1].map((axis) => places.reduce((sum, place) => sum + place[axis], 0) / places.length);

function text(words, [x, y], unit, kind) {
  const size = { "font-size": 12.5 * unit, "stroke-width": 3.5 * unit };
  return shape("text", { x, y, class: `caption-text ${kind}`, ...size, "aria-hidden": "true" }, words);
}

function captions(area, context) {
  const places = area.corners.map(context.surface.toDrawing);
  return area.kind === "line" ? lineCaptions(area, places, context) : nameCaption(area, context, places);
}

/** The name of an area in its middle, with the count of a zone. */
function nameCaption(area, { editor, unit, countOf }, places) {
  const words = [area.name || capital(titleOf(area, editor.areas)), countOf(area)?.split(" ")[0]];
  return [text(words.filter(Boolean).join(" · "), middleOf(places), unit, area.kind)];
}

/** Half the width of a caption, pixels of the screen. */
const halfWidth = (words) => 3.6 * words.length;

/** Moves captions down until none covers an earlier one. */
function apart(shapes, unit) {
  const boxes = [];
  for (const node of shapes.filter(({ tagName }) => tagName === "text")) {
    const [x, wide] = [Number(node.getAttribute("x")), halfWidth(node.textContent) * unit];
    let y = Number(node.getAttribute("y"));
    const isOver = (box) => Math.abs(box.x - x) < box.wide + wide && Math.abs(box.y - y) < (CAPTION_HEIGHT - 1) * unit;
    for (let covered = boxes.find(isOver); covered; covered = boxes.find(isOver)) y = covered.y + CAPTION_HEIGHT * unit;
    node.setAttribute("y", y);
    boxes.push({ x, y, wide });
  }
  return shapes;
}

/**
 * The name of a line at the end that is farther from the middle of the surface, and its directions on the sides that they
 * count toward.
 */
function lineCaptions({ name, directions }, [from, to], { surface, unit }) {
  const along = [to[0] - from[0], to[1] - from[1]];
  const length = Math.hypot(...along) || 1;
  // The right side, seen along the line.
  const right = [-along[1] / length, along[0] / length];
  const middle = middleOf([from, to]);
  const beside = (distance) => middle.map((value, axis) => value + right[axis] * distance * unit);
  const arrow = [beside(-14), beside(14)];
  const tip = [[-5, 8], [0, 14], [5, 8]].map(([across, ahead]) =>
    beside(ahead).map((value, axis) => value + (along[axis] / length) * across * unit),
  );
  const middleOfSurface = surface.toDrawing(surface.middle);
  const distance = (place) => Math.hypot(...place.map((value, axis) => value - middleOfSurface[axis]));
  const [end, sign] = distance(from) > distance(to) ? [from, -1] : [to, 1];
  const beyond = sign * (16 + (halfWidth(name) * Math.abs(along[0])) / length) * unit;
  const nameAt = end.map((value, axis) => value + (along[axis] / length) * beyond);
  // Words beside a line that goes up need their width, beside one that goes across their height.
  const besideFor = (words, side) => beside(side * (16 + (halfWidth(words) * Math.abs(right[0]) + 8 * Math.abs(right[1]))));
  return [
    shape("polyline", { points: points(arrow), class: "arrow", "stroke-width": 2 * unit }),
    shape("polyline", { points: points(tip), class: "arrow", "stroke-width": 2 * unit }),
    text(name, nameAt, unit, "line"),
    text(directions[0], besideFor(directions[0], 1), unit, "line direction"),
    text(directions[1], besideFor(directions[1], -1), unit, "line direction"),
  ];
}

function handles(area, { editor, surface, unit }) {
  const between = middles(area).map((place, index) =>
    handle(surface.toDrawing(place), unit, {
      kind: "middle", radius: 4, node: `middle-${area.key}-${index}`, key: area.key, attribute: { "data-before": index + 1 },
      label: `Add a corner after corner ${index + 1}`,
    }),
  );
  const places = area.corners.map((place, index) =>
    handle(surface.toDrawing(place), unit, {
      kind: editor.selected.corner === index ? "corner chosen" : "corner", radius: 6.5, node: `corner-${area.key}-${index}`, key: area.key,
      attribute: { "data-corner": index }, label: `${area.kind === "line" ? "End" : "Corner"} ${index + 1}, ${surface.describe(place)}`,
    }),
  );
  return [...between, ...places];
}

/** A handle with an area of a finger's width. */
function handle([x, y], unit, { kind, radius, node, key, attribute, label }) {
  return shape(
    "g",
    { class: `grip ${kind}`, "data-node": node, "data-key": key, ...attribute, tabindex: 0, role: "button", "aria-label": label },
    shape("circle", { cx: x, cy: y, r: (radius + 8) * unit, class: "hit" }),
    shape("circle", { cx: x, cy: y, r: radius * unit, class: "dot", "stroke-width": 2 * unit }),
  );
}

function draftShapes({ kind, corners, cursor }, { editor, surface, unit }) {
  const places = [...corners, cursor].map(surface.toDrawing);
  const outline = points(places);
  const name = kind === "line" ? "polyline" : "polygon";
  return [
    shape(
      "g",
      { class: `area draft ${kind}`, "data-kind": kind },
      shape(name, { points: outline, class: "casing", "stroke-width": 4.5 * unit }),
      shape(name, { points: outline, class: "outline", "stroke-width": 2 * unit }),
    ),
    ...places.slice(0, -1).map(([cx, cy], index) => {
      // A click on the first corner finishes.
      const [kindOf, radius] = index === 0 && editor.canFinish ? ["draft-corner end", 8] : ["draft-corner", 4.5];
      return shape("circle", { class: kindOf, cx, cy, r: radius * unit, "stroke-width": 2 * unit });
    }),
    cursorShape(places.at(-1), unit),
  ];
}

function cursorShape([x, y], unit) {
  const reach = 11 * unit;
  const cross = `M${x - reach} ${y}h${2 * reach}M${x} ${y - reach}v${2 * reach}`;
  return shape("path", { class: "cursor", d: cross, "stroke-width": 1.6 * unit });
}
