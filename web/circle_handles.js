/** The circle over the frame; that of the form has two handles with the same function as its fields. */

import { shape } from "./dom.js";

/** Draws a circle with its center into `drawing`; returns the unit of the drawing's strokes. */
export function drawRim(drawing, { width, height, cx, cy, radius }) {
  drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const unit = Math.max(width, height) / 480;
  drawing.replaceChildren(
    shape("circle", { class: "casing", cx, cy, r: radius, "stroke-width": 4.5 * unit }),
    shape("circle", { class: "rim", cx, cy, r: radius, "stroke-width": 2 * unit }),
    shape("path", { class: "rim", d: `M${cx - 12 * unit} ${cy}h${24 * unit}M${cx} ${cy - 12 * unit}v${24 * unit}`, "stroke-width": 1.5 * unit }),
  );
  return unit;
}

/** Draws the circle into `drawing`; calls `moved` with `{cx, cy}` or `{radius}` while a handle is dragged. */
export function drawCircle(drawing, circle, moved) {
  const unit = drawRim(drawing, circle);
  const { cx, cy, radius } = circle;
  const handle = (name, x, y, act) => {
    const node = shape("circle", { class: "handle", "data-handle": name, cx: x, cy: y, r: 9 * unit, "stroke-width": 2.5 * unit });
    node.addEventListener("pointerdown", (event) => drag(drawing, event, act));
    return node;
  };
  // On the diagonal, which is inside the frame even if the circle fills it.
  const side = radius * Math.SQRT1_2;
  drawing.append(
    handle("center", cx, cy, ([x, y]) => moved({ cx: x, cy: y })),
    handle("rim", cx + side, cy + side, ([x, y], now) => moved({ radius: Math.hypot(x - now.cx, y - now.cy) })),
  );
  drawing.circle = { cx, cy };
}

function drag(drawing, event, act) {
  event.preventDefault();
  drawing.setPointerCapture(event.pointerId);
  const move = (moving) => {
    const toDrawing = drawing.getScreenCTM().inverse();
    const { x, y } = new DOMPoint(moving.clientX, moving.clientY).matrixTransform(toDrawing);
    act([x, y], drawing.circle);
  };
  drawing.addEventListener("pointermove", move);
  for (const end of ["pointerup", "pointercancel"]) {
    drawing.addEventListener(end, () => drawing.removeEventListener("pointermove", move), { once: true });
  }
}
