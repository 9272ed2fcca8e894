/** One click on a false box in Cameras ignores its place: it is written into the calibration of the camera, with undo. */

import { element, find, shape } from "./dom.js";
import { corners, foot, pointBelow, points } from "./geometry.js";
import { ask, askJson } from "./server.js";

/** The radius of an ignored place: meters on the floor, and the least share of the frame's width. */
const RADIUS_M = 0.5;
const LEAST_SHARE = 0.015;
/** The corners of an ignored place. */
const CORNERS = 8;
/** The half field of view of an assumed lens, radians. */
const ASSUMED_THETA = Math.PI / 2;
/** The names that a calibration may have. */
const PLAIN_NAME = /^[a-z0-9][a-z0-9_-]{0,63}$/;

let canChange = null;

/** Returns true if the key may change calibrations. */
async function mayChange() {
  canChange ??= askJson("assets/options.json").then(({ can_change: can }) => Boolean(can), () => false);
  return canChange;
}

/** Forgets what the key may do. */
export const forgetKey = () => (canChange = null);

/**
 * Adds the boxes of the report over the image of a card. A click ignores the place of a box. Boxes move, so that the
 * keyboard ignores places in Zones instead.
 */
export async function addBoxes(card, others) {
  if (!(await mayChange()) || !card.report) return;
  const { report } = card;
  const { width, height } = report.image;
  const boxes = report.persons.map((person, index) => {
    const ignore = () => change(card, (file) => withIgnored(file, person, report), others);
    const label = `Ignore the place of person ${index + 1}, score ${person.score.toFixed(2)}`;
    return shape(
      "polygon",
      // A click ends after the next report may have replaced the box: it counts when it begins.
      { points: points(corners(person.oriented_box)), "data-box": index, onpointerdown: ignore },
      shape("title", {}, label),
    );
  });
  const drawing = shape("svg", { class: "ignorable", "aria-hidden": "true", viewBox: `0 0 ${width} ${height}` }, ...boxes);
  const sight = find(".sight", card.node);
  find(".ignorable", sight)?.remove();
  sight.append(drawing);
}

/** Writes the calibration of a card's camera after `edit`, and offers Undo. */
async function change(card, edit, others) {
  const own = await ownCalibration(card, others);
  if (own.problem) return tell(card, own.problem);
  const before = own.file.ignore ?? [];
  const file = edit(own.file);
  try {
    const tag = await put(own.id, file, own.tag);
    const undo = element("button", { type: "button", onclick: () => restore(card, own.id, before, tag) }, "Undo");
    tell(card, `The place is ignored from the next frame on. ${own.note}`, undo);
  } catch (problem) {
    const lines = JSON.stringify({ ignore: file.ignore }, null, 1).slice(1, -1).trim();
    const text = `Not saved: ${problem.message} To write it yourself, add these lines to the calibration ${own.id}:`;
    tell(card, text, element("pre", {}, lines));
  }
}

/** Takes an ignored place back. */
async function restore(card, id, ignore, tag) {
  try {
    const { file } = await read(id);
    const { ignore: _, ...rest } = file;
    await put(id, ignore.length ? { ...rest, ignore } : rest, tag);
    tell(card, "The place counts again.");
  } catch (problem) {
    tell(card, `Not taken back: ${problem.message} Remove it in Zones.`);
  }
}

async function read(id) {
  const answer = await ask(`calibrations/${id}`);
  return { id, file: await answer.json(), tag: answer.headers.get("ETag") };
}

/** Stores a calibration; returns its new entity tag. */
async function put(id, file, tag) {
  const headers = tag ? { "If-Match": tag } : { "If-None-Match": "*" };
  const answer = await ask(`calibrations/${id}`, { method: "PUT", body: JSON.stringify(file), headers });
  return answer.headers.get("ETag");
}

/**
 * The calibration of the camera alone: `{id, file, tag, note}`. One that other cameras use, or an assumed lens, becomes
 * a calibration with the camera's name first.
 */
async function ownCalibration({ camera, report }, others) {
  const { id, assumed } = report.calibration;
  const sharing = others.filter((other) => other.camera !== camera && other.report?.calibration.id === id);
  if (!assumed && !sharing.length) return { ...(await read(id)), note: "" };
  if (!PLAIN_NAME.test(camera)) {
    return { problem: `Not saved: ${camera} cannot be the name of a calibration. Save one in Calibrate, and name it in the frames.` };
  }
  const why = assumed ? "Its lens was assumed" : `${id} is also used by ${sharing.map((other) => other.camera).join(", ")}`;
  const note = `${why}: ${camera} now has the calibration ${camera}. Its frames must name it: calibration=${camera}.`;
  const stored = await askJson("calibrations");
  if (stored.some((calibration) => calibration.id === camera)) return { ...(await read(camera)), note };
  const file = assumed ? assumedFile(camera, report) : { ...(await read(id)).file, id: camera };
  return { id: camera, file, tag: null, note };
}

/** The calibration of the lens that the server assumed. Its pixel centers are half a pixel before those of reports. */
export function assumedFile(id, { image, calibration: { assumed_circle: circle } }) {
  const lens = { model: "equidistant", focal: circle.radius / ASSUMED_THETA, cx: circle.cx - 0.5, cy: circle.cy - 0.5, max_theta: ASSUMED_THETA };
  return { id, image, lens, mount: { world_up: [0, 0, -1] } };
}

/** The calibration file with the place of a person as an ignored place. */
export function withIgnored(file, person, report) {
  const used = new Set((file.ignore ?? []).map(({ name }) => name));
  let number = 1;
  while (used.has(`ignore-${number}`)) number += 1;
  const place = { name: `ignore-${number}`, ...placeOf(person, file, report) };
  return { ...file, ignore: [...(file.ignore ?? []), place] };
}

/** The polygon around the foot: on the floor where the height is known, else in the frame. */
function placeOf(person, file, report) {
  if (person.floor && file.mount?.height_m) {
    const { x_m: x, y_m: y } = person.floor;
    return { floor_m: around([x, y], RADIUS_M, 2) };
  }
  const [scaleX, scaleY] = [file.image.width / report.image.width, file.image.height / report.image.height];
  const [x, y] = foot(person, pointBelow(file, report));
  const radius = Math.max(person.oriented_box.width / 2, LEAST_SHARE * report.image.width);
  return { frame_px: around([x * scaleX, y * scaleY], radius * scaleX, 1) };
}

function around([x, y], radius, decimals) {
  const factor = 10 ** decimals;
  return Array.from({ length: CORNERS }, (_, corner) => {
    const turn = ((corner + 0.5) * 2 * Math.PI) / CORNERS;
    return [x + radius * Math.cos(turn), y + radius * Math.sin(turn)].map((value) => Math.round(value * factor) / factor);
  });
}

/** Shows a message below the image of a card, until the next one. */
function tell(card, text, ...nodes) {
  card.message = element("div", { class: "ignored-note", role: "status" }, text, ...nodes);
  find(".ignored-note", card.node)?.remove();
  find(".sight", card.node).after(card.message);
}
