/** The section Calibrate: edits a circle over the frame or imports a file, previews its views, and saves it. */

import { heightOf, replacedIn, withHeight } from "./calibration_sources.js";
import { showValues } from "./calibration_values.js";
import { drawCircle, drawRim } from "./circle_handles.js";
import { showViews, startDivider } from "./comparison.js";
import { afterPause, element, find } from "./dom.js";
import { startFinding } from "./find_lens.js";
import { MODELS, assumedCircle, calibrationOf, circleOf, rimOf, withFound } from "./lens.js";
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
 * An imported file: `{name, content, needsSize}`, or `{name, file, ownHeight, needsSize}` for a calibration of the server
 * or a found one, which takes the name and the height in the form; null while the circle is edited. `ownHeight` is the
 * height to which the form returns. A found one has `found`, `replaces` and `before`, too.
 */
let imported = null;
/** The circle over the frame; its `cameraHeight` is the height in the form. */
let circle = null;
/** The circle that was drawn before the frame had a report; a change makes another one. */
let guessed = null;
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
  const isGuess = !circle || (report && circle === guessed);
  if (isGuess) {
    setCircle(assumedCircle(report ?? { image: { width, height } }));
    guessed = report ? null : circle;
  }
  if (isNew && frame.camera) shown(ofCamera)(frame);
  if (isVisible && (isNew || isGuess)) previewShown();
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
  setHeight(circle.cameraHeight);
  drawn();
}

function setHeight(height) {
  circle = { ...circle, cameraHeight: height };
  field("cameraHeight").value = height ? Number(height.toFixed(2)) : "";
}

/** The height that the user typed, or that of the circle: not the one that a shown file brought. */
const typedHeight = () => (imported?.file && circle.cameraHeight === heightOf(imported.file) ? imported.ownHeight : circle.cameraHeight);

/** Shows a file instead of the circle, with its height in the form. */
function showFile(file, ownHeight, rest) {
  imported = { ...rest, file, ownHeight, needsSize: false };
  setHeight(heightOf(file));
  drawn();
}

function drawn() {
  const drawing = find("#circle");
  const rim = imported?.file && rimOf(imported.file);
  if (rim) drawRim(drawing, rim);
  else if (imported) drawing.replaceChildren();
  else drawCircle(drawing, circle, (moved) => edited({ ...circle, ...moved }));
  for (const name of FIELDS) find(`output[for=calibrate-${name}]`).textContent = Number(field(name).value).toFixed(1);
  const name = field("id").value;
  const isOwn = imported?.name === id();
  const loss = isServing(name) && !isOwn ? ` Everything in ${name} is replaced, also its zones, lines and masks.` : "";
  find("#import-name").textContent = imported ? `${importNote()}${loss}` : "";
  showValues(imported?.file || (opened && !imported) ? currentFile() : null, { found: imported?.found, replaces: isOwn ? imported.replaces : [] });
  find("label[for=import-camera]").hidden = !imported?.content;
  Object.assign(find("#circle-fields"), { disabled: Boolean(imported), hidden: Boolean(imported) });
  field("cameraHeight").disabled = Boolean(imported?.content);
  find("#import-fields").hidden = !imported;
  find("#save").textContent = isServing(name) ? `Replace ${name}` : "Save";
  if (name !== usersOf) {
    usersOf = name;
    usersSoon();
  }
}

function importNote() {
  if (imported.found) return "Found in this frame: walls and doors must be straight and upright in the views.";
  if (imported.file) return `${imported.name} keeps its lens. Its height can be changed.`;
  return `${imported.name} is saved unchanged.`;
}

function edited(next) {
  setCircle(next);
  previewSoon();
}

/** The shown file of the server or a found one, or that of the circle. */
function currentFile(base = opened?.file) {
  return imported ? withHeight({ ...imported.file, id: id() }, circle.cameraHeight) : calibrationOf({ id: id(), ...circle }, base);
}

const content = (base) => imported?.content ?? JSON.stringify(currentFile(base), null, 2);
const id = () => field("id").value || "camera";

/** The query for an imported file: the camera, and the frame size if the format has none. */
function reading() {
  const query = new URLSearchParams();
  if (imported?.content && field("camera").value) query.set("camera", field("camera").value);
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
  const former = imported?.before;
  const viewsBefore = () => (former ? straightened(frame, JSON.stringify({ ...former, id: id() }), "", signal) : []);
  const both = () => Promise.all([straightened(frame, content(), reading(), signal), viewsBefore()]);
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
  return isOpened ? opened.file : calibrationOf({ id: id(), ...circle }, opened?.file);
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
  if (!imported?.content) opened = await read(name);
  if (imported?.file) showFile(opened.file, heightOf(opened.file), { ...imported, name, replaces: [] });
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

/** Shows a calibration that was found in earlier frames of the camera. */
export async function openFound(found) {
  const { id: name } = found.calibration;
  field("id").value = name;
  await showFit(name, found);
}

/** Shows a calibration that was found with its values; nothing is saved. Everything else in a calibration of this name stays. */
async function showFit(name, found) {
  const base = isServing(name) ? await read(name) : null;
  if (base) opened = base;
  const typed = typedHeight();
  const file = withFound(base?.file, found.calibration, typed);
  showFile(file, typed, { name, found, replaces: replacedIn(base?.file), before: before() });
  await preview();
}

/** Loads a calibration of the server. */
async function open(name) {
  opened = await read(name);
  const { file } = opened;
  const known = circleOf(file);
  field("id").value = name;
  if (known) {
    imported = null;
    setCircle(known);
  } else showFile(file, heightOf(file), { name });
  await preview();
}

export function visible(is) {
  isVisible = is;
  if (!is) return;
  begin();
  previewShown();
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
    const { name, value } = event.target;
    if (name === "cameraHeight") circle = { ...circle, cameraHeight: Number(value) || null };
    else if (event.target.closest("#circle-fields")) circle = { ...circle, [name]: name === "model" ? value : Number(value) };
    if (event.target.closest("#circle-fields, #import-fields, #height-field")) previewSoon();
    if (circle) drawn();
  });
  form().addEventListener("submit", (event) => {
    event.preventDefault();
    shown(save)();
  });
  startFinding(id, showFit, (file, signal) => straightened(shared.frame, JSON.stringify({ ...file, id: id() }), "", signal));
  find("#import-file").addEventListener("change", (event) => {
    const [file] = event.target.files;
    event.target.value = "";
    if (file) shown(importFile)(file);
  });
  find("#drop-import").addEventListener("click", () => {
    const height = typedHeight();
    imported = null;
    setHeight(height);
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
