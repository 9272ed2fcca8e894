/** Pointer and keyboard events on the drawing, as edits. */

import { movedBy } from "./areas.js";

/** The distance in pixels of the screen within which a corner snaps to another, and a click finishes an outline. */
const SNAP_PIXELS = 9;
/** The distance in pixels of the screen before a press moves an area. */
const DRAG_PIXELS = 4;
/** The factor of the step of the arrow keys with Shift. */
const FAST = 10;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

let drags = 0;
let drag = null;

/**
 * Listens to `drawing`; `current` returns `{editor, surface}`, or null while nothing is shown. `ended` is called after
 * a drag.
 */
export function startGestures(drawing, current, ended) {
  const act = (type, handler) =>
    drawing.addEventListener(type, (event) => {
      const shown = current();
      if (shown) handler(event, shown, drawing);
    });
  act("pointerdown", pressed);
  act("pointermove", moved);
  act("pointerup", () => {
    if (!drag) return;
    drag = null;
    ended();
  });
  act("pointercancel", cancelled);
  act("click", clicked);
  act("keydown", keyPressed);
  act("focusin", ({ target }, { editor }) => {
    const { key, corner } = target.dataset;
    if (corner !== undefined && !drag) editor.select(key, Number(corner));
  });
}

/** The place of a pointer event, and a screen pixel, both in the space of the surface. */
function placeOf(event, surface, drawing) {
  const toDrawing = drawing.getScreenCTM().inverse();
  const at = (x, y) => {
    const point = new DOMPoint(x, y).matrixTransform(toDrawing);
    return surface.toPlace([point.x, point.y]);
  };
  const place = at(event.clientX, event.clientY);
  return { place, pixel: Math.abs(at(event.clientX + 1, event.clientY)[0] - place[0]) };
}

const distance = ([x, y], [otherX, otherY]) => Math.hypot(x - otherX, y - otherY);

/** Returns the nearest of `others` within the snap distance, or `place`. */
function snapped({ place, pixel }, others) {
  const near = others.filter((other) => distance(other, place) <= SNAP_PIXELS * pixel);
  near.sort((one, other) => distance(one, place) - distance(other, place));
  return near[0] ?? place;
}

/** The corners to which those of an area may snap. */
const othersOf = ({ areas }, { space }, key) =>
  areas.filter((area) => area.space === space && area.key !== key).flatMap((area) => area.corners);

function pressed(event, { editor, surface }, drawing) {
  if (editor.draft || event.button !== 0) return;
  const node = event.target.closest("[data-key]");
  if (!node) {
    editor.select(null);
    return;
  }
  event.preventDefault();
  const { key, corner, before } = node.dataset;
  drags += 1;
  drag = {
    key,
    corner: corner === undefined ? null : Number(corner),
    mark: `drag-${drags}`,
    from: [event.clientX, event.clientY],
    isMoving: false,
  };
  drawing.setPointerCapture(event.pointerId);
  if (before !== undefined) {
    drag.corner = Number(before);
    editor.addCorner(key, drag.corner, placeOf(event, surface, drawing).place, surface.bounds, drag.mark);
  } else {
    editor.select(key, drag.corner);
  }
  const name = drag.corner === null ? `area-${key}` : `corner-${key}-${drag.corner}`;
  drawing.querySelector(`[data-node="${name}"]`)?.focus({ preventScroll: true });
  drag.start = placeOf(event, surface, drawing).place;
  drag.area = editor.area(key);
}

function moved(event, { editor, surface }, drawing) {
  if (editor.draft) {
    editor.moveCursor(cursorPlace(event, editor, surface, drawing), surface.bounds);
    return;
  }
  if (!drag) return;
  drag.isMoving ||= distance([event.clientX, event.clientY], drag.from) >= DRAG_PIXELS;
  if (!drag.isMoving) return;
  const at = placeOf(event, surface, drawing);
  if (drag.corner === null) {
    const by = [0, 1].map((axis) => at.place[axis] - drag.start[axis]);
    editor.change(movedBy(drag.area, by, surface.bounds), drag.mark);
  } else {
    editor.moveCorner(drag.key, drag.corner, snapped(at, othersOf(editor, surface, drag.key)), surface.bounds, drag.mark);
  }
}

function cancelled(_event, { editor }) {
  if (!drag) return;
  const { mark } = drag;
  drag = null;
  editor.cancelChange(mark);
}

/** True while an area or a corner is being dragged. */
export const isDragging = () => drag !== null;

function cursorPlace(event, editor, surface, drawing) {
  return snapped(placeOf(event, surface, drawing), [...editor.draft.corners.slice(0, 1), ...othersOf(editor, surface, null)]);
}

function clicked(event, { editor, surface }, drawing) {
  if (!editor.draft) return;
  if (event.detail > 1) {
    if (editor.canFinish) editor.finish();
    return;
  }
  editor.moveCursor(cursorPlace(event, editor, surface, drawing), surface.bounds);
  editor.addAtCursor();
}

function keyPressed(event, { editor, surface }, drawing) {
  const handled = editor.draft ? draftKey(event, editor, surface) : areaKey(event, editor, surface, drawing);
  if (!handled) return;
  event.preventDefault();
  event.stopPropagation();
}

/** The step of an arrow key in the space of the surface, or null. */
function stepOf({ key, shiftKey }, surface) {
  const size = surface.step * (shiftKey ? FAST : 1);
  return ARROWS[key]?.map((value) => value * size) ?? null;
}

const sum = (place, step) => place.map((value, axis) => value + step[axis]);

function draftKey(event, editor, surface) {
  const step = stepOf(event, surface);
  if (step) editor.moveCursor(sum(editor.draft.cursor, step), surface.bounds);
  else if (event.key === "Enter" || event.key === " ") editor.addAtCursor();
  else if (event.key === "Delete" || event.key === "Backspace") editor.removeLastCorner();
  else if (event.key === "Escape") editor.cancelDraft();
  else return false;
  return true;
}

function areaKey(event, editor, surface, drawing) {
  const { key, corner, before } = event.target.dataset;
  const step = stepOf(event, surface);
  const focus = (name) => drawing.querySelector(`[data-node="${name}"]`)?.focus({ preventScroll: true });
  if (event.key === "Escape") {
    if (drag) cancelled(event, { editor });
    else if (corner !== undefined) {
      editor.select(key);
      focus(`area-${key}`);
    } else if (editor.selected) editor.select(null);
    else return false;
    return true;
  }
  if (key === undefined) return false;
  const isEnter = event.key === "Enter" || event.key === " ";
  const isDelete = event.key === "Delete" || event.key === "Backspace";
  if (before !== undefined) {
    if (!isEnter) return false;
    const { corners } = editor.area(key);
    const [from, to] = [corners[before - 1], corners[before % corners.length]];
    editor.addCorner(key, Number(before), [0, 1].map((axis) => (from[axis] + to[axis]) / 2), surface.bounds, null);
    focus(`corner-${key}-${before}`);
  } else if (corner !== undefined) {
    const place = editor.area(key).corners[corner];
    if (step) editor.moveCorner(key, Number(corner), sum(place, step), surface.bounds, `keys-${key}-${corner}`);
    else if (isDelete) {
      editor.removeCorner(key, Number(corner));
      if (editor.selected.corner === null) focus(`area-${key}`);
    } else return false;
  } else if (step) editor.change(movedBy(editor.area(key), step, surface.bounds), `keys-${key}`);
  else if (isDelete) editor.removeArea(key);
  else if (isEnter) editor.select(key);
  else return false;
  return true;
}
