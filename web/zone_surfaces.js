/** The two surfaces of areas: the frame and the floor map, with the persons of a report. */

import { shape } from "./dom.js";
import { VIEW_BOX, floorDot, floorGrid, floorPlaces, reachOf, scaleOf } from "./floor_map.js";
import { corners, foot, pointBelow, points } from "./geometry.js";
import { pixelOfFloor } from "./lens.js";

/** Steps of the arrow keys: the share of the frame's longer side, and meters on the floor. */
const FRAME_STEPS = 500;
const FLOOR_STEP_M = 0.05;
/** The parts of an edge on the floor: a straight line there is a curve in the frame. */
const EDGE_PARTS = 16;
/** The maximum distance of corners on the floor, meters. */
const FARTHEST_M = 1000;

const numbers = (text) => text.split(" ").map(Number);

/** The frame, in pixels of frames of the size of a calibration file. */
export function frameSurface(file) {
  const { image } = file;
  const projected = pixelOfFloor(file);
  const { width, height } = image;
  const scaled = (report) => ([x, y]) => [(x * width) / report.image.width, (y * height) / report.image.height];
  return {
    space: "frame_px",
    viewBox: [0, 0, width, height],
    bounds: [0, 0, width, height],
    middle: [width / 2, height / 2],
    step: Math.max(1, Math.round(Math.max(width, height) / FRAME_STEPS)),
    toDrawing: (place) => place,
    toPlace: (point) => point,
    describe: ([x, y]) => `${x}, ${y} pixels`,
    outlineOnFloor: (area) => projected && subdivided(area).map(projected).filter(Boolean),
    backdrop: (report, unit) =>
      (report?.persons ?? []).flatMap((person) => {
        const toDrawing = scaled(report);
        const [x, y] = toDrawing(foot(person, pointBelow(file, report)));
        const outline = points(corners(person.oriented_box).map(toDrawing));
        return [
          shape("polygon", { points: outline, class: "person-box", "stroke-width": 1.4 * unit }),
          shape("circle", { cx: x, cy: y, r: 4.5 * unit, class: "person-foot", "stroke-width": 1.5 * unit }),
        ];
      }),
  };
}

/** The outline of an area with further corners on its edges. */
function subdivided({ kind, corners: places }) {
  const edges = kind === "line" ? places.slice(0, -1) : places;
  const along = edges.flatMap((place, index) => {
    const next = places[(index + 1) % places.length];
    return Array.from({ length: EDGE_PARTS }, (_, part) => place.map((value, axis) => value + ((next[axis] - value) * part) / EDGE_PARTS));
  });
  return kind === "line" ? [...along, places.at(-1)] : along;
}

/** The floor, in meters from the point below the camera, with room for these areas and the persons of `report`. */
export function floorSurface(areas, report) {
  const persons = floorPlaces(report?.persons ?? []);
  const outlines = areas.filter(({ space }) => space === "floor_m").flatMap((area) => area.corners);
  const reach = reachOf([...persons.filter(Boolean), ...outlines]);
  const scale = scaleOf(reach);
  return {
    space: "floor_m",
    viewBox: numbers(VIEW_BOX),
    bounds: [-FARTHEST_M, -FARTHEST_M, FARTHEST_M, FARTHEST_M],
    middle: [0, 0],
    step: FLOOR_STEP_M,
    toDrawing: (place) => place.map((value) => value * scale),
    toPlace: (point) => point.map((value) => value / scale),
    describe: ([x, y]) => `${x} m right, ${y} m down`,
    backdrop: () => [...floorGrid(reach), ...persons.flatMap((place, index) => (place ? [floorDot(place, index, scale)] : []))],
  };
}
