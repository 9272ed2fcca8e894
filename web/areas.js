/** The zones, lines, masks, areas and ignored places of a calibration: reading, writing, and edits of their corners. */

/** The kinds of areas: their field in a calibration and their numbers of corners. */
export const KINDS = {
  zone: { field: "zones", least: 3, most: 64 },
  line: { field: "lines", least: 2, most: 2 },
  mask: { field: "masks", least: 3, most: 64 },
  area: { field: "areas", least: 3, most: 64 },
  ignore: { field: "ignore", least: 3, most: 64 },
};
/** The maximum number of areas of a kind in a calibration. */
export const MOST_OF_A_KIND = 32;
/** The decimals of coordinates: pixels of the frame, meters on the floor. */
const DECIMALS = { frame_px: 1, floor_m: 2 };
const DIRECTIONS = ["in", "out"];
/** The words for kinds that are not their own word. */
const TITLES = { ignore: "ignored place" };

let lastKey = 0;

/** A new area. `key` identifies it while the page is open; `space` is the field of its corners; `lying` is `expected` for a bed. */
export function areaOf(kind, space, name, corners, directions = DIRECTIONS, lying = undefined) {
  lastKey += 1;
  return { key: String(lastKey), kind, space, name, corners, directions, lying };
}

/** The areas of a calibration file. */
export function areasOf(file) {
  return Object.entries(KINDS).flatMap(([kind, { field }]) =>
    (file[field] ?? []).map((entry) => {
      const space = entry.floor_m ? "floor_m" : "frame_px";
      return areaOf(kind, space, entry.name ?? "", entry[space], entry.directions, entry.lying);
    }),
  );
}

/** The calibration file with these areas instead of its own. */
export function withAreas(file, areas) {
  const changed = { ...file };
  for (const [kind, { field }] of Object.entries(KINDS)) {
    const entries = areas.filter((area) => area.kind === kind).map(entryOf);
    if (entries.length) changed[field] = entries;
    else delete changed[field];
  }
  return changed;
}

function entryOf({ kind, space, name, corners, directions, lying }) {
  const entry = { [space]: corners };
  if (kind !== "mask" && (name || !isNameless(kind))) entry.name = name;
  if (kind === "line") entry.directions = directions;
  if (lying) entry.lying = lying;
  return entry;
}

/** True for kinds whose areas need no name. */
const isNameless = (kind) => ["mask", "area", "ignore"].includes(kind);

/** The calibration file with its areas scaled to frames of the size `image`. */
export function scaledTo(file, image) {
  const factors = [image.width / file.image.width, image.height / file.image.height];
  const scaled = (area) =>
    area.space === "frame_px" ? { ...area, corners: area.corners.map((place) => place.map((value, axis) => value * factors[axis])) } : area;
  return withAreas({ ...file, image }, areasOf(file).map(scaled));
}

/** Returns the area that a message of the server names, and the message without the field; null if it names none. */
export function problemOf(detail, areas) {
  const [, field, index, text] = /\b(zones|lines|masks|areas|ignore)\[(\d+)\][\w.[\]]*: (.*)/.exec(detail) ?? [];
  const area = areas.filter(({ kind }) => KINDS[kind].field === field)[Number(index)];
  return area ? { key: area.key, text: `${text[0].toUpperCase()}${text.slice(1)}.` } : null;
}

/** The title of an area: its kind and name. Areas without a name have numbers. */
export function titleOf(area, areas) {
  if (area.name) return `${TITLES[area.kind] ?? area.kind} ${area.name}`;
  return `${TITLES[area.kind] ?? area.kind} ${areas.filter(({ kind }) => kind === area.kind).indexOf(area) + 1}`;
}

/** The first free name of a kind, such as `zone-2`. */
export function freeName(kind, areas) {
  const used = new Set(areas.filter((area) => area.kind === kind).map(({ name }) => name));
  let number = 1;
  while (used.has(`${kind}-${number}`)) number += 1;
  return `${kind}-${number}`;
}

/** Rounds a place to the decimals of its space, inside `bounds` (`[x_min, y_min, x_max, y_max]`). */
export function placed(space, place, bounds) {
  const factor = 10 ** DECIMALS[space];
  return place.map((value, axis) => {
    const inside = Math.min(Math.max(value, bounds[axis]), bounds[axis + 2]);
    return Math.round(inside * factor) / factor || 0;
  });
}

export const withCornerAt = (area, corner, place) => ({ ...area, corners: area.corners.with(corner, place) });
export const withNewCorner = (area, corner, place) => ({ ...area, corners: area.corners.toSpliced(corner, 0, place) });
export const withoutCorner = (area, corner) => ({ ...area, corners: area.corners.toSpliced(corner, 1) });

/** The area moved by `by`, as far as `bounds` permit. */
export function movedBy(area, by, bounds) {
  const step = by.map((value, axis) => {
    const values = area.corners.map((place) => place[axis]);
    const least = Math.min(bounds[axis] - Math.min(...values), 0);
    const most = Math.max(bounds[axis + 2] - Math.max(...values), 0);
    return Math.min(Math.max(value, least), most);
  });
  const everywhere = [-Infinity, -Infinity, Infinity, Infinity];
  const corners = area.corners.map((place) => placed(area.space, place.map((value, axis) => value + step[axis]), everywhere));
  return { ...area, corners };
}

/** The middle of each edge. A line has none to add a corner at. */
export function middles({ kind, corners }) {
  if (kind === "line" || corners.length >= KINDS[kind].most) return [];
  return corners.map(([x, y], index) => {
    const [nextX, nextY] = corners[(index + 1) % corners.length];
    return [(x + nextX) / 2, (y + nextY) / 2];
  });
}
