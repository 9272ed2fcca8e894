/** Ideal lenses: converts a circle and a field of view to a calibration file and back. */

import { scaledTo } from "./areas.js";
import { heightOf, otherSources, sourcesOfCircle, withHeight } from "./calibration_sources.js";

/** The radius divided by the focal length for an angle from the axis. */
const CURVES = {
  equidistant: (theta) => theta,
  equisolid: (theta) => 2 * Math.sin(theta / 2),
  stereographic: (theta) => 2 * Math.tan(theta / 2),
  orthographic: (theta) => Math.sin(theta),
};

/** The names of these lenses. */
export const MODELS = Object.keys(CURVES);

const STRAIGHT_DOWN = [0, 0, -1];

/**
 * The calibration file of a lens whose image is a circle: `cx`, `cy` and `radius` in corner-origin pixels of a
 * frame of `width` × `height`, `fieldOfView` in degrees, `cameraHeight` in meters or null. Everything else, such as
 * zones, is that of the file `base`.
 */
export function calibrationOf({ id, width, height, model, cx, cy, radius, fieldOfView, cameraHeight }, base = null) {
  const maxTheta = (fieldOfView / 2) * (Math.PI / 180);
  const image = { width, height };
  // Lens functions use pixel centers.
  const lens = { model, focal: radius / CURVES[model](maxTheta), cx: cx - 0.5, cy: cy - 0.5, max_theta: maxTheta };
  const mount = { ...base?.mount, world_up: STRAIGHT_DOWN };
  const sources = sourcesOfCircle(base, isCircleOf({ image, lens }, base));
  return withHeight({ ...(base && scaledTo(base, image)), id, image, lens, mount, sources }, cameraHeight);
}

/** True if a lens that looks straight down is that of a file, apart from rounding. */
function isCircleOf({ image, lens }, file) {
  const theirs = file && circleOf(file);
  if (!theirs) return false;
  const ofLens = { ...file.lens, focal: file.lens.focal ?? file.lens.fx };
  const isSameLens = ["focal", "cx", "cy", "max_theta"].every((name) => Math.abs(lens[name] - ofLens[name]) < 1e-6);
  return isSameLens && lens.model === theirs.model && image.width === theirs.width && image.height === theirs.height;
}

/** The file `base` with a found lens and level. The height `height` of the form, or that of the file, is kept with its source. */
export function withFound(base, { id, image, lens, mount, sources = {} }, height = null) {
  const known = height ?? heightOf(base);
  const { height_m: foundHeight, ...level } = mount;
  const { height_m: foundSource, ...found } = sources;
  const file = { ...(base && scaledTo(base, image)), id, image, lens, mount: { ...base?.mount, ...level }, sources: { ...otherSources(base), ...found } };
  if (known) return withHeight(file, known);
  if (foundHeight) Object.assign(file.mount, { height_m: foundHeight });
  if (foundHeight && foundSource) Object.assign(file.sources, { height_m: foundSource });
  return file;
}

/** The function of `CURVES`, or that of Kannala and Brandt with the coefficients `k`; undefined for any other lens. */
const curveOf = ({ model, k }) =>
  model === "kannala_brandt" ? (theta) => theta * (1 + k.reduceRight((sum, part) => theta ** 2 * (sum + part), 0)) : CURVES[model];

/** The angle from the axis at which lenses are compared: people stand around it. */
const COMPARED_THETA = Math.PI / 4;

/** The difference of two lenses at 45° from the axis, percent of the radius there. */
export function differenceOf(...lenses) {
  const [one, other] = lenses.map((lens) => (lens.focal ?? lens.fx) * curveOf(lens)(COMPARED_THETA));
  return (Math.abs(one - other) / Math.min(one, other)) * 100;
}

/** The circle that the lens of a file sees, in corner-origin pixels of a frame of `width` × `height`; null if it is none or not known here. */
export function rimOf({ lens, image }) {
  const curve = curveOf(lens);
  const focal = lens.focal ?? (lens.fx === lens.fy ? lens.fx : null);
  if (!curve || !focal || !lens.max_theta) return null;
  return { ...image, cx: lens.cx + 0.5, cy: lens.cy + 0.5, radius: focal * curve(lens.max_theta) };
}

/**
 * Returns the corner-origin pixel of a place on the floor, in meters from the point below the camera of a file; null if
 * the lens does not see it. Returns null instead of the function if the height or the lens is not known here.
 */
export function pixelOfFloor({ lens, mount }) {
  const curve = curveOf(lens);
  const height = mount?.height_m;
  if (!curve || !height) return null;
  const [fx, fy] = [lens.focal ?? lens.fx, lens.focal ?? lens.fy];
  const down = (mount.world_up ?? STRAIGHT_DOWN).map((part) => -part / Math.hypot(...(mount.world_up ?? STRAIGHT_DOWN)));
  // The smallest rotation of straight down to the camera's axis: around z × down.
  const [wx, wy] = [-down[1], down[0]];
  return ([px, py]) => {
    const turned = wx * py - wy * px;
    const cross = [wy * height, -wx * height, turned];
    const twice = [wy * cross[2], -wx * cross[2], wx * cross[1] - wy * cross[0]];
    const [x, y, z] = [px, py, height].map((part, axis) => part + cross[axis] + twice[axis] / (1 + down[2]));
    const across = Math.hypot(x, y);
    const theta = Math.atan2(across, z);
    if (theta > (lens.max_theta ?? Math.PI / 2)) return null;
    const radius = across ? curve(theta) / across : 0;
    return [lens.cx + 0.5 + fx * radius * x, lens.cy + 0.5 + fy * radius * y];
  };
}

/** The circle from which `calibrationOf` makes this file; null if there is none. */
export function circleOf({ lens, mount, image }) {
  const rim = CURVES[lens.model] ? rimOf({ lens, image }) : null;
  const up = mount?.world_up ?? STRAIGHT_DOWN;
  const isTilted = up.some((part, axis) => Math.abs(part - STRAIGHT_DOWN[axis]) > 1e-6);
  if (!rim || isTilted) return null;
  return {
    ...rim,
    model: lens.model,
    fieldOfView: (lens.max_theta * 360) / Math.PI,
    cameraHeight: mount?.height_m ?? null,
  };
}

/** The lens that the server assumed for a frame; without one in the report, the largest circle in the middle. */
export function assumedCircle({ image, calibration }) {
  const { width, height } = image;
  const middle = { cx: width / 2, cy: height / 2, radius: Math.min(width, height) / 2 };
  const { cx, cy, radius } = calibration?.assumed_circle ?? middle;
  return { width, height, model: "equidistant", cx, cy, radius, fieldOfView: 180, cameraHeight: null };
}
