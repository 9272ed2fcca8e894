/** The section Calibrate: edits a circle over the frame or imports a file, previews its views, and saves it. */

import { drawCircle } from "./circle_handles.js";
import { showViews, startDivider } from "./comparison.js";
import { afterPause, element, find } from "./dom.js";
import { MODELS, assumedCircle, calibrationOf, circleOf, withFound } from "./lens.js";
import { isServing, loadCalibrations } from "./parameters.js";
import { shown, showFailure, withProgress } from "./progress.js";
import { Problem, ask, askJson } from "./server.js";
import { shared, whenChanged } from "./shared.js";
import { viewCanvas } from "./straighten.js";
import { GRID_CELLS } from "./views.js";

const FIELDS = ["cx", "cy", "radius", "fieldOfView"];
/** The pause after the last change before the preview is updated. */
const REST_MILLIS = 120;
const PREVIEW_PIXELS = 320;
/** The most cameras whose calibration is asked for. */
const MAX_USERS = 60;
/** The names that a calibration may have. */
const PLAIN_NAME = /^[a-z0-9][a-z0-9_-]{0,63}$/;

/**
 * An imported file: `{name, content, needsSize}`, or `{name, file, needsSize}` for a calibration of the server or a found
 * one, which takes the name in the form; null while the circle is edited.
 */
let imported = null;
let circle = null;
/** The calibration that was opened: `{name, file, tag}`. A saved circle keeps everything in it but the lens. */
let opened = null;
let isVisible = false;
let trying = null;
/** The calibration whose users are shown. */
let usersOf = null;

const form = () => find("#calibration-form");
const field = (name) => form().elements[name];

/** The circle of the frame: the detected one, or the largest that fits. */
function begin() {
  const { frame, report } = shared;
  find("#calibrate-empty").hidden = Boolean(frame);
  find("#calibrate-content").hidden = !frame;
  if (!frame) return;
  const image = find("#calibrate-frame");
  const { width, height } = frame;
  const isNew = image.src !== frame.url;
  if (isNew) {
    Object.assign(image, { src: frame.url, width, height });
    [circle, opened, imported] = [null, null, null];
  }
  if (!circle) setCircle(assumedCircle(report ?? { image: { width, height } }));
  if (isNew && frame.camera) shown(ofCamera)(frame);
  if (isVisible) previewShown();
}

/** Begins with the calibration of the frame's camera, or with its name for a new one. */
async function ofCamera({ camera }) {
  const used = find("#calibration").value;
  if (used) return open(used);
  field("id").value = PLAIN_NAME.test(camera) ? camera : "";
  drawn();
}

/** Says which cameras use the named calibration. */
async function showUsers() {
  const asked = id();
  const rows = await askJson("results");
  const latest = await Promise.all(rows.slice(0, MAX_USERS).map(({ camera }) => askJson(`results/${encodeURIComponent(camera)}/latest`)));
  const using = latest.filter(({ calibration }) => calibration.id === asked && !calibration.assumed).map(({ camera }) => camera);
  if (asked !== id()) return;
  const others = using.length ? `Used by ${using.join(", ")}: saving applies to the next frame.` : "";
  find("#calibration-users").textContent = others || (field("id").value ? `A camera named ${asked} uses it from its next frame on.` : "");
}

const usersSoon = afterPause(REST_MILLIS, shown(showUsers));

function setCircle(next) {
  circle = next;
  const reach = Math.max(circle.width, circle.height);
  for (const name of FIELDS) {
    if (name !== "fieldOfView") field(name).max = reach;
    field(name).value = circle[name].toFixed(1);
  }
  field("model").value = circle.model;
  field("cameraHeight").value = circle.cameraHeight ?? "";
  drawn();
}

function drawn() {
  const drawing = find("#circle");
  drawing.classList.toggle("off", Boolean(imported));
  if (imported) drawing.replaceChildren();
  else drawCircle(drawing, circle, (moved) => edited({ ...circle, ...moved }));
  for (const name of FIELDS) find(`output[for=calibrate-${name}]`).textContent = Number(field(name).value).toFixed(1);
  const id = field("id").value;
  const loss = isServing(id) && imported?.name !== id ? ` The zones, lines and masks of ${id} are not kept.` : "";
  find("#import-name").textContent = imported?.isFound ? "Found in this frame: walls and doors must be straight and upright in the views." : imported ? `${imported.name} is saved unchanged.${loss}` : "";
  find("#found-values").hidden = !imported?.isFound;
  find("label[for=import-camera]").hidden = Boolean(imported?.isFound);
  find("#circle-fields").disabled = Boolean(imported);
  find("#import-fields").hidden = !imported;
  find("#save").textContent = isServing(id) ? `Replace ${id}` : "Save";
  if (id !== usersOf) {
    usersOf = id;
    usersSoon();
  }
}

function edited(next) {
  setCircle(next);
  previewSoon();
}

function content(base = opened?.file) {
  if (imported?.content) return imported.content;
  return JSON.stringify(imported ? { ...imported.file, id: id() } : calibrationOf({ id: id(), ...circle }, base), null, 2);
}
const id = () => field("id").value || "camera";

/** The query for an imported file: the camera, and the frame size if the format has none. */
function reading() {
  const query = new URLSearchParams();
  if (imported && field("camera").value) query.set("camera", field("camera").value);
  if (imported?.needsSize) query.set("size", `${shared.frame.width}x${shared.frame.height}`);
  return query;
}

async function preview() {
  const { frame } = shared;
  if (!frame || !circle) return;
  previewSoon.cancel();
  trying?.abort();
  trying = new AbortController();
  const { signal } = trying;
  const both = () => Promise.all([straightened(frame, content(), reading(), signal), imported?.isFound ? straightened(frame, before(), "", signal) : []]);
  const attempt = () => both().catch(sizeOr(both));
  showViews(...(await withProgress(find("#previews-progress"), "Straightening", attempt)));
}

/** The canvases of the frame's views with a calibration. */
async function straightened(frame, body, query, signal) {
  const asked = new URLSearchParams([["profile", "fast"], ["grid", GRID_CELLS], ...new URLSearchParams(query)]);
  const plan = await askJson(`calibrations/${id()}/views?${asked}`, { method: "POST", body, signal });
  return plan.views.map((view) => viewCanvas(view, GRID_CELLS, frame, plan.image[0], PREVIEW_PIXELS));
}

/** The calibration that a found one is compared with: the opened one, or the circle. */
function before() {
  const isOpened = opened && !circleOf(opened.file);
  return JSON.stringify(isOpened ? opened.file : calibrationOf({ id: id(), ...circle }, opened?.file));
}

/** Repeats a request that lacks the frame size with the size of the current frame. */
const sizeOr = (again) => (problem) => {
  if (!imported || imported.needsSize || problem.parameter !== "size") throw problem;
  imported.needsSize = true;
  return again();
};

const previewShown = shown(preview);
const previewSoon = afterPause(REST_MILLIS, previewShown);

async function save() {
  const name = id();
  const answer = await withProgress(find("#save-progress"), "Saving", () => put(name));
  const { warnings = [] } = await answer.json();
  if (!imported) opened = await read(name);
  await loadCalibrations();
  find("#saved").textContent = [`${name} is saved and in use.`, ...warnings.map(({ message }) => message)].join(" ");
  find("#calibration").value = name;
  find("#parameters").dispatchEvent(new Event("input"));
  drawn();
}

/** Reads a calibration of the server: `{name, file, tag}`. */
async function read(name) {
  const answer = await ask(`calibrations/${name}`);
  return { name, file: await answer.json(), tag: answer.headers.get("ETag") };
}

/** Replaces the current calibration of this name, of which a circle keeps everything but the lens, or creates it. */
async function put(name) {
  let [base, headers] = [opened?.file, { "If-None-Match": "*" }];
  if (imported && imported.name === name && opened?.name === name) headers = { "If-Match": opened.tag };
  else if (isServing(name)) {
    const current = await read(name);
    headers = { "If-Match": current.tag };
    base = current.file;
    if (!imported && opened?.name === name && cameraOf(base) !== cameraOf(opened.file)) {
      opened = current;
      const remedy = "Open it again under Start from, or save again to replace it.";
      throw new Problem(412, `${name} has another lens or mount since it was opened here. ${remedy}`);
    }
  }
  return ask(`calibrations/${name}?${reading()}`, { method: "PUT", body: content(base), headers });
}

/** The part of a calibration that the circle replaces, as text. */
const cameraOf = ({ image, lens, mount }) => JSON.stringify([image, lens, mount]);

/** Imports a file from the disk; the server parses it. */
async function importFile(file) {
  const text = await file.text();
  imported = { name: file.name, content: text, needsSize: false };
  // A native file has an ID.
  const own = /"id"\s*:\s*"([a-z0-9][a-z0-9_-]{0,63})"/.exec(text);
  if (own) field("id").value = own[1];
  drawn();
  await preview();
}

/** The query for what is known of the camera before its lens is found. */
function known() {
  const query = new URLSearchParams();
  if (field("knownLens").value) query.set("lens", field("knownLens").value);
  if (field("knownPlace").value) query.set("ceiling", true);
  return query;
}

/** Finds lens, center and level from the straight edges of the frame. Everything else in a calibration of this name stays. */
async function findLens() {
  const { frame } = shared;
  const name = id();
  const found = await withProgress(find("#find-progress"), "Finding the lens", () => askJson(`calibrations/${name}/fit?${known()}`, { method: "POST", body: frame.blob }));
  if (shared.frame === frame) await showFit(name, found);
}

/** Shows a calibration that was found in earlier frames of the camera. */
export async function openFound(found) {
  const { id: name } = found.calibration;
  field("id").value = name;
  await showFit(name, found);
}

/** Shows a calibration that was found with its values; nothing is saved. */
async function showFit(name, found) {
  const base = isServing(name) ? await read(name) : null;
  if (base) opened = base;
  const height = base?.file.mount?.height_m ?? circle.cameraHeight;
  imported = { name, file: withFound(base?.file, found.calibration, height), needsSize: false, isFound: true };
  showFound(found);
  drawn();
  await preview();
}

function showFound({ calibration: { lens, mount, sources }, field_of_view_deg: fieldOfView, tilt_deg: tilt, edges, explained }) {
  const rows = [
    ["Field of view", `${fieldOfView.toFixed(1)}°, radius ± ${sources.lens.uncertainty.toFixed(2)} %`],
    ["Center", `${(lens.cx + 0.5).toFixed(1)}, ${(lens.cy + 0.5).toFixed(1)} ± ${sources.center.uncertainty.toFixed(1)} pixels`],
    ["Tilt", `${tilt.toFixed(1)}° ± ${sources.world_up.uncertainty.toFixed(2)}°`],
    ...(sources.height_m?.source === "from_people" ? [["Height", `${mount.height_m.toFixed(2)} m ± ${sources.height_m.uncertainty.toFixed(2)} m, from people`]] : []),
    ["Edges", `${Math.round(explained * 100)} % of ${edges} follow the room`],
  ];
  find("#found-values").replaceChildren(...rows.map(([title, text]) => element("div", {}, element("dt", {}, title), element("dd", {}, text))));
}

/** Loads a calibration of the server. */
async function open(name) {
  opened = await read(name);
  const { file } = opened;
  const known = circleOf(file);
  field("id").value = name;
  imported = known ? null : { name, file, needsSize: false };
  if (known) setCircle(known);
  drawn();
  await preview();
}

export function visible(is) {
  isVisible = is;
  if (is) begin();
}

export function start() {
  startDivider();
  for (const name of ["knownLens", "model"]) field(name).append(...MODELS.map((model) => element("option", {}, model)));
  whenChanged(["frame", "report"], begin);
  whenChanged(["calibrations"], () => {
    const choice = find("#open-calibration");
    choice.replaceChildren(choice.firstElementChild, ...shared.calibrations.map(({ id }) => element("option", { value: id }, id)));
  });
  form().addEventListener("input", (event) => {
    find("#saved").textContent = "";
    if (event.target.closest("#circle-fields")) {
      const values = Object.fromEntries(FIELDS.map((name) => [name, Number(field(name).value)]));
      circle = { ...circle, ...values, model: field("model").value, cameraHeight: Number(field("cameraHeight").value) || null };
    }
    if (event.target.closest("#circle-fields, #import-fields")) previewSoon();
    if (circle) drawn();
  });
  form().addEventListener("submit", (event) => {
    event.preventDefault();
    shown(save)();
  });
  find("#find-lens").addEventListener("click", shown(findLens));
  find("#import-file").addEventListener("change", (event) => {
    const [file] = event.target.files;
    event.target.value = "";
    if (file) shown(importFile)(file);
  });
  find("#drop-import").addEventListener("click", () => {
    imported = null;
    showFailure(find("#previews-progress"), "");
    drawn();
    previewShown();
  });
  find("#open-calibration").addEventListener("change", (event) => {
    const name = event.target.value;
    event.target.value = "";
    if (name) shown(open)(name);
  });
}
