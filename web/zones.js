/** The section Zones: draws the zones, lines, masks, areas and ignored places of a calibration, and saves them. */

import { personsIn } from "./area_counts.js";
import { AreaEditor } from "./area_editor.js";
import { isDragging, startGestures } from "./area_gestures.js";
import { scrollToRow, showList } from "./area_list.js";
import { drawAreas } from "./area_shapes.js";
import { areaOf, areasOf, problemOf, titleOf, withAreas } from "./areas.js";
import { options } from "./camera_states.js";
import { element, find, plural } from "./dom.js";
import { isServing, loadCalibrations } from "./parameters.js";
import { shown, showFailure, withProgress } from "./progress.js";
import { ask, askJson } from "./server.js";
import { shared, whenChanged } from "./shared.js";
import { frameSurface, floorSurface } from "./zone_surfaces.js";

let isVisible = false;
/** The documents by calibration: `{id, file, tag, listed, editor}`. Unsaved drawings stay here. */
const documents = new Map();
let shownDocument = null;
let space = "frame_px";
let surface = null;
/** True if the server counts people, so that it knows where they walked. */
let hasCounts = false;
/** The area that the server refused: `{key, text, area}`. */
let invalid = null;

const drawing = () => find("#areas");
/** The report, if it is of the shown calibration. */
const ownReport = () => (shared.report?.calibration.id === shownDocument.id ? shared.report : null);
/** The listed revision of a calibration, as an entity tag. */
const listedTag = (id) => `"${shared.calibrations.find((calibration) => calibration.id === id)?.revision}"`;
/** True if a newer version was listed after this one was read. */
const isOld = ({ id, tag, listed }) => ![tag, listed].includes(listedTag(id));

/** Reads a calibration: `{file, tag}`; null if there is none. */
async function read(id) {
  try {
    const answer = await ask(`calibrations/${id}`);
    return { file: await answer.json(), tag: answer.headers.get("ETag") };
  } catch (problem) {
    if (problem.status === 404) return null;
    throw problem;
  }
}

/** Shows the calibration that Detect uses. */
async function show() {
  const id = find("#calibration").value;
  const isKnown = Boolean(shared.frame) && isServing(id);
  find("#zones-choice").hidden = !shared.frame || !shared.calibrations.length;
  find("#zones-calibration").value = id;
  find("#zones-empty").hidden = isKnown;
  find("#zones-content").hidden = !isKnown;
  find("#zones-reason").textContent = reason();
  if (!isVisible || !isKnown) return;
  ({ has_counts: hasCounts = false } = await options());
  if (find("#calibration").value !== id) return;
  let opened = documents.get(id);
  if (!opened || (!opened.editor.isUnsaved && !opened.editor.draft && isOld(opened))) {
    const loaded = await withProgress(find("#zones-progress"), "Reading the calibration", () => read(id));
    if (!loaded || find("#calibration").value !== id) return;
    opened = { id, ...loaded, listed: listedTag(id), editor: new AreaEditor(areasOf(loaded.file), draw) };
    documents.set(id, opened);
  }
  if (shownDocument !== opened) {
    shownDocument = opened;
    invalid = null;
    showConflict(null);
    find("#zones-saved").textContent = "";
    if (!hasFloor()) space = "frame_px";
  }
  const image = find("#zones-frame");
  if (image.src !== shared.frame.url) image.src = shared.frame.url;
  draw();
}

function reason() {
  if (!shared.frame) return "Use the frame of a camera in Cameras, or pick one in Detect: zones are drawn on it.";
  if (!shared.calibrations.length) return "Zones are stored in the calibration of the camera. Save one in Calibrate first.";
  return "Choose the calibration of this camera: its zones, lines, masks and areas are drawn here.";
}

const hasFloor = () => Boolean(shownDocument.file.mount?.height_m);

/** The text of the count of a zone; null for other areas, and without a report. */
function countOf(area) {
  const count = area.kind === "zone" ? personsIn(area, ownReport(), shownDocument.file) : null;
  return count === null ? null : plural(count, "person");
}

function draw() {
  if (!isVisible || !shownDocument) return;
  const { editor, file, id } = shownDocument;
  const { selectedArea, draft } = editor;
  if (invalid && editor.area(invalid.key) !== invalid.area) {
    invalid = null;
    showFailure(find("#zones-save-progress"), "");
  }
  if (selectedArea && !isDragging()) space = selectedArea.space;
  // The map of the floor keeps its scale while something is dragged.
  if (!isDragging() || !surface) surface = space === "floor_m" ? floorSurface(editor.areas, ownReport()) : frameSurface(file);
  showStage();
  const unit = 1 / (drawing().getScreenCTM()?.a || 1);
  drawAreas(drawing(), { editor, surface, report: ownReport(), unit, countOf, invalid: invalid?.key });
  showList(find("#area-list"), { editor, countOf, invalid });
  find("#area-none").hidden = editor.areas.length > 0;
  for (const button of document.querySelectorAll("#area-kinds button")) {
    button.setAttribute("aria-pressed", String(button.dataset.kind === draft?.kind));
    button.disabled = button.dataset.kind === "mask" && space === "floor_m";
  }
  find("#suggest-area").hidden = !(hasCounts && shared.frame.camera && hasFloor()) || Boolean(draft);
  find("#undo").disabled = !editor.canUndo;
  find("#redo").disabled = !editor.canRedo;
  find("#draft").hidden = !draft;
  find("#surfaces").hidden = Boolean(draft);
  find("#draft-hint").textContent = draft ? hint(draft) : "";
  find("#draft-finish").hidden = draft?.kind === "line";
  find("#draft-finish").disabled = !editor.canFinish;
  find("#zones-note").textContent = editor.note;
  find("#zones-save").textContent = `Save ${id}`;
  find("#zones-unsaved").hidden = !editor.isUnsaved;
  if (editor.isUnsaved) find("#zones-saved").textContent = "";
}

function hint({ kind, corners }) {
  if (kind === "line") return corners.length ? "Click the other end." : "Click one end of the line.";
  return corners.length < 3 ? "Click the corners." : "Click the first corner to finish.";
}

function showStage() {
  const stage = find("#zones-stage");
  const isFloor = space === "floor_m";
  stage.classList.toggle("on-floor", isFloor);
  find("#zones-frame").hidden = isFloor;
  const [, , width, height] = surface.viewBox;
  stage.style.aspectRatio = `${width} / ${height}`;
  drawing().setAttribute("viewBox", surface.viewBox.join(" "));
  for (const input of document.querySelectorAll("#surfaces input")) input.checked = input.value === space;
  find("#surface-floor").disabled = !hasFloor();
  find("#surface-reason").hidden = hasFloor();
}

async function save() {
  const saving = shownDocument;
  const { id, file, tag, editor } = saving;
  const sent = editor.areas;
  const host = find("#zones-save-progress");
  const headers = tag ? { "If-Match": tag } : { "If-None-Match": "*" };
  const options = { method: "PUT", body: JSON.stringify(withAreas(file, sent)), headers };
  invalid = null;
  showConflict(null);
  let answer;
  try {
    answer = await withProgress(host, "Saving", () => ask(`calibrations/${id}`, options));
  } catch (problem) {
    if (problem.status === 412) {
      showFailure(host, "");
      showConflict(saving);
    } else if (problem.status === 422) showInvalid(problemOf(problem.message, sent), sent, host, editor);
    throw problem;
  }
  Object.assign(saving, { file: withAreas(file, sent), tag: answer.headers.get("ETag") });
  editor.saved(sent);
  const { warnings = [], coverage = [] } = await answer.json();
  const shares = coverage.map(({ field, percent }) => `${field} covers ${percent.toFixed(1)} % of the frame.`);
  const texts = [`${id} is saved and in use.`, ...shares, ...warnings.map(({ message }) => message)];
  find("#zones-saved").textContent = texts.join(" ");
  await loadCalibrations();
  find("#parameters").dispatchEvent(new Event("input"));
}

/** Shows a refusal at the area that it names. */
function showInvalid(problem, sent, host, editor) {
  if (!problem) return;
  const area = sent.find(({ key }) => key === problem.key);
  invalid = { ...problem, area };
  showFailure(host, `Not saved: see ${titleOf(area, sent)}.`);
  editor.select(problem.key);
  draw();
  scrollToRow(problem.key);
}

/** Offers both remedies of a conflict; hides them if `conflicting` is null. */
function showConflict(conflicting) {
  const panel = find("#zones-conflict");
  panel.hidden = !conflicting;
  if (!conflicting) return;
  const { id, editor } = conflicting;
  find("#zones-conflict-text").textContent =
    `Not saved: ${id} was changed elsewhere since it was opened here. Your drawing is still here. ` +
    "Save it over the other zones, lines and masks, or take the other version: Undo brings your drawing back.";
  const settle = (keeps) =>
    shown(async () => {
      const now = await withProgress(find("#zones-save-progress"), "Reading the calibration", () => read(id));
      Object.assign(conflicting, now ?? { tag: null });
      showConflict(null);
      if (keeps) await save();
      else editor.replaceAll(now ? areasOf(now.file) : [], { isSaved: Boolean(now) });
    });
  find("#conflict-buttons").replaceChildren(
    element("button", { type: "button", class: "primary", onclick: settle(true) }, "Save my drawing"),
    element("button", { type: "button", onclick: settle(false) }, "Take the other version"),
  );
}

const showShown = shown(show);

export function visible(is) {
  isVisible = is;
  showShown();
}

/** Begins to draw; the keyboard moves a cursor from the middle. */
function begin(kind) {
  const { editor } = shownDocument;
  if (editor.draft?.kind === kind) {
    editor.cancelDraft();
    return;
  }
  editor.begin(kind, space, surface.middle);
  if (editor.draft) drawing().focus({ preventScroll: true });
}

/** Adds the area in which people walked in the last day. */
async function suggestArea() {
  const { editor } = shownDocument;
  const path = `counts/${encodeURIComponent(shared.frame.camera)}/suggested-area`;
  const { floor_m: corners } = await withProgress(find("#zones-save-progress"), "Reading the walks", () => askJson(path));
  editor.add(areaOf("area", "floor_m", "", corners));
}

function chooseSurface(chosen) {
  const { editor } = shownDocument;
  space = chosen;
  if (editor.draft) editor.cancelDraft();
  editor.select(null);
  draw();
}

/** Undo and redo from the keyboard, except in text fields, and Escape beside the drawing. */
function shortcut(event) {
  if (!isVisible || !shownDocument) return;
  if (shownDocument.editor.draft && event.key === "Escape") shownDocument.editor.cancelDraft();
  if (!(event.ctrlKey || event.metaKey) || event.target.matches("input")) return;
  const letter = event.key.toLowerCase();
  if (letter !== "z" && letter !== "y") return;
  event.preventDefault();
  if (letter === "y" || event.shiftKey) shownDocument.editor.redo();
  else shownDocument.editor.undo();
}

export function start() {
  whenChanged(["frame", "report"], showShown);
  whenChanged(["calibrations"], () => {
    const choice = find("#zones-calibration");
    choice.replaceChildren(choice.firstElementChild, ...shared.calibrations.map(({ id }) => element("option", { value: id }, id)));
    showShown();
  });
  find("#zones-calibration").addEventListener("change", ({ target }) => {
    find("#calibration").value = target.value;
    find("#parameters").dispatchEvent(new Event("input"));
    showShown();
  });
  startGestures(drawing(), () => shownDocument && surface && { editor: shownDocument.editor, surface }, draw);
  new ResizeObserver(draw).observe(find("#zones-stage"));
  for (const button of document.querySelectorAll("#area-kinds button")) button.addEventListener("click", () => begin(button.dataset.kind));
  for (const input of document.querySelectorAll("#surfaces input")) input.addEventListener("change", () => chooseSurface(input.value));
  const press = (id, act) => find(id).addEventListener("click", () => act(shownDocument.editor));
  press("#undo", (editor) => editor.undo());
  press("#redo", (editor) => editor.redo());
  press("#draft-finish", (editor) => editor.finish());
  press("#draft-cancel", (editor) => editor.cancelDraft());
  find("#suggest-area").addEventListener("click", shown(suggestArea));
  find("#zones-save").addEventListener("click", shown(save));
  document.addEventListener("keydown", shortcut);
  window.addEventListener("beforeunload", (event) => {
    if ([...documents.values()].some(({ editor }) => editor.isUnsaved)) event.preventDefault();
  });
}
