/** Geometry in the frame, in corner-origin pixels. */

/** The corners of an oriented box, clockwise from its top left: its height axis is `angle_deg` clockwise from image up. */
export function corners({ cx, cy, width, height, angle_deg: degrees }) {
  const turn = (degrees * Math.PI) / 180;
  const [sin, cos] = [Math.sin(turn), Math.cos(turn)];
  const across = [-1, 1, 1, -1].map((sign) => (sign * width) / 2);
  const along = [-1, -1, 1, 1].map((sign) => (sign * height) / 2);
  return across.map((x, corner) => [cx + x * cos - along[corner] * sin, cy + x * sin + along[corner] * cos]);
}

/** Returns true if a point lies in an outline (even-odd rule). */
export function holds(outline, [x, y]) {
  let inside = false;
  outline.forEach(([x1, y1], index) => {
    const [x2, y2] = outline[(index + 1) % outline.length];
    if (y1 > y !== y2 > y && x < x1 + ((y - y1) / (y2 - y1)) * (x2 - x1)) inside = !inside;
  });
  return inside;
}

/** Formats points for the attribute `points` of a polygon. */
export const points = (places) => places.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ");

/** The center of a person's box. */
export const center = ({ oriented_box: box }) => [box.cx, box.cy];

/** Cameras that look down to within 30° of it see feet nearer to the point below them than heads. */
const LOOKS_DOWN = -Math.cos(Math.PI / 6);

/** The point below the camera of a calibration file, in pixels of the report; null if it does not look down. */
export function pointBelow({ image, lens, mount }, report) {
  const [x, y, z] = mount?.world_up ?? [0, 0, -1];
  if (!lens || z > LOOKS_DOWN) return null;
  const tilt = Math.hypot(x, y);
  const shift = tilt > 0 ? ((lens.focal ?? lens.fx ?? 0) * Math.atan2(tilt, -z)) / tilt : 0;
  const scale = report.image.width / image.width;
  return [(lens.cx + 0.5 - x * shift) * scale, (lens.cy + 0.5 - y * shift) * scale];
}

/** The foot of a person: the end of the box that is nearer to the point `below` the camera; the lower end if that is null. */
export function foot({ oriented_box: { cx, cy, height, angle_deg: degrees } }, below) {
  const turn = (degrees * Math.PI) / 180;
  const half = [(-Math.sin(turn) * height) / 2, (Math.cos(turn) * height) / 2];
  const isAbove = below && half[0] * (below[0] - cx) + half[1] * (below[1] - cy) < 0;
  return isAbove ? [cx - half[0], cy - half[1]] : [cx + half[0], cy + half[1]];
}

/** The smallest of 1, 2 and 5 times a power of ten of which `most` steps reach `length`. */
export function roundStep(length, most) {
  const least = length / most;
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= least * (1 - 1e-9));
}
