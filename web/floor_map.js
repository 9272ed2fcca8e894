/** The map of the floor: rings of equal distance around the camera, and persons as numbered dots. */

import { shape } from "./dom.js";
import { roundStep } from "./geometry.js";

/** Half the side of the map, in drawing units. */
const HALF = 240;
/** The minimum extent of a map, meters. */
const LEAST_REACH = 3;
const MOST_RINGS = 6;

export const VIEW_BOX = `${-HALF} ${-HALF} ${2 * HALF} ${2 * HALF}`;

/** The extent of a map with these places, meters from the camera to its sides. */
export const reachOf = (places) => Math.max(LEAST_REACH, ...places.map(([x, y]) => Math.hypot(x, y))) * 1.12;

/** Drawing units per meter. */
export const scaleOf = (reach) => HALF / reach;

/** The places of persons on the floor, null where unknown. */
export const floorPlaces = (persons) => persons.map(({ floor }) => (floor ? [floor.x_m, floor.y_m] : null));

/** The axes, the rings and the camera. */
export function floorGrid(reach) {
  const scale = scaleOf(reach);
  const step = roundStep(reach, MOST_RINGS);
  const rings = Array.from({ length: Math.floor(reach / step) }, (_, index) => (index + 1) * step);
  const label = (ring) => `${Number(ring.toFixed(3))} m`;
  return [
    shape("path", { d: `M${-HALF} 0H${HALF}M0 ${-HALF}V${HALF}`, class: "axis" }),
    ...rings.flatMap((ring) => [
      shape("circle", { r: ring * scale, class: "ring" }),
      shape("text", { x: 4, y: -ring * scale - 4, class: "meters" }, label(ring)),
    ]),
    shape("path", { d: "M-7 0L0 -7L7 0L0 7Z", class: "camera" }, shape("title", {}, "The camera")),
  ];
}

/** The dot of a person. */
export function floorDot([x, y], index, scale, listeners = {}) {
  return shape(
    "g",
    { class: "dot-mark", "data-person": index, transform: `translate(${x * scale} ${y * scale})`, ...listeners },
    shape("circle", { r: 12 }),
    shape("text", {}, String(index + 1)),
  );
}
