/** A card of a camera: image, number of persons, plot, state, and the tools that use its frame. */

import { showDay } from "./camera_day.js";
import { options, retention } from "./camera_states.js";
import { addCounts, layersBelow } from "./counts.js";
import { element, find } from "./dom.js";
import { addBoxes } from "./ignore_place.js";
import { addViews } from "./live_view.js";
import { sketch } from "./marks.js";
import { stepPlot } from "./plot.js";
import { shown, withProgress } from "./progress.js";
import { teaching } from "./reference_counts.js";
import { crossingTeaching } from "./reference_crossings.js";
import { ask } from "./server.js";
import { showSuggestion } from "./suggestion.js";
import { useFrame } from "./use_frame.js";

/** The widths of images in a card, and in one that fills the page. */
const [WIDTH, SINGLE_WIDTH] = [480, 1200];
const TOOLS = ["Detect", "Views", "Floor", "Calibrate", "Zones"];

/** Creates the card of a camera. `onchange` opens its settings, `reread` reads its state again. */
export function addCard(camera, { onchange, reread }) {
  const link = element("a", { href: `#camera/${encodeURIComponent(camera)}` }, camera);
  const age = element("span", { class: "age" });
  const now = element("div", { class: "now-shown" });
  const state = element("p", { class: "camera-state", role: "status" });
  const suggestion = element("div", { class: "suggestion", role: "group", "aria-label": `Suggested calibration of ${camera}` });
  const day = element("section", { class: "day", "aria-label": `The day of ${camera}`, hidden: true });
  const strip = element("div", { class: "strip" });
  const manage = element("span", { class: "manage" });
  const node = element("article", { class: "card", "aria-label": `Camera ${camera}`, "data-camera": camera });
  const card = { camera, node, now, age, state, suggestion, day, strip, manage, onchange, reread, info: null, isSingle: false };
  Object.assign(card, { id: "0", history: [], reportedAt: 0, report: null, drawn: 0, image: null, bar: null, suggestedAt: 0, suggested: "", hasImage: true, isAsking: false, isTooLow: false, message: null });
  card.teaching = teaching(card);
  card.crossings = crossingTeaching(card);
  const use = (section) => shown(() => withProgress(strip, "Reading the frame", () => useFrame(card, section)));
  const tools = TOOLS.map((name) => element("button", { type: "button", onclick: use(name.toLowerCase()) }, name));
  const group = element("div", { class: "use-frame", role: "group", "aria-label": `Use this frame of ${camera}` }, element("span", { class: "muted", "aria-hidden": "true" }, "Use this frame:"), ...tools);
  card.remedy = element("button", { type: "button", class: "quiet", hidden: true, onclick: chooseAutomatically(card) }, "Set Rate and Profile to automatic");
  node.append(element("header", {}, element("h2", {}, link), age), now, addViews(card), state, card.remedy, suggestion, card.teaching.node, day, card.crossings.node, element("footer", {}, group, manage, strip));
  return card;
}

export function removeCard(card) {
  card.node.remove();
  if (card.image) URL.revokeObjectURL(card.image.src);
}

/** Draws the latest report of a card. */
export function drawCard(card, others) {
  card.drawn = 0;
  const { report, history } = card;
  tellAge(card);
  if (!report) {
    card.now.replaceChildren(element("div", { class: "sight waiting" }, element("p", {}, "Waiting for the first frame.")));
    return;
  }
  const count = history.at(-1).persons;
  const zones = report.zones?.map(({ name, persons }) => element("li", {}, `${name} `, element("b", {}, String(persons))));
  card.now.replaceChildren(
    element("div", { class: "sight" }, card.live.view ? card.live.image : (card.image ?? sketch(report)), element("p", { class: "big" }, element("b", {}, count === null ? "–" : String(count)), count === null ? "" : errorBar(card.bar, count), count === null ? "paused" : count === 1 ? "person" : "persons")),
    card.isSingle && !card.hasImage && !card.info ? imagesOff(card.camera) : "",
    zones ? element("ul", { class: "zones" }, zones) : "",
    stepPlot(history, Date.now()),
  );
  options().then(({ can_change: may }) => (card.live.group.hidden = !may));
  showImage(card);
  addCounts(card);
  showDay(card);
  card.teaching.refresh();
  if (card.message) find(".sight", card.node).after(card.message);
  addBoxes(card, others);
}

/** The error bar of a number: the larger side of it. */
function errorBar(bar, count) {
  if (!bar) return "";
  const [low, high] = bar;
  return element("span", { class: "error-bar", title: `In 9 of 10 frames, ${low} to ${high} people are there` }, ` ± ${Math.max(high - count, count - low)} `);
}

const imagesOff = (camera) => element("p", { class: "muted images-off" }, "Images of this camera are not kept. The setting ", element("code", {}, `results.images = ["${camera}"]`), " shows them.");

/** Replaces the sketch by the image of the latest report, if the server stores images of this camera. */
async function showImage(card) {
  if (!card.hasImage || card.isAsking || card.node.hidden || card.info?.keep_image === false) return;
  card.isAsking = true;
  const width = card.isSingle ? SINGLE_WIDTH : WIDTH;
  try {
    const answer = await ask(`results/${encodeURIComponent(card.camera)}/latest.jpg?draw=${layersBelow(card)}&width=${width}`);
    const image = element("img", { alt: `The latest frame of ${card.camera}`, src: URL.createObjectURL(await answer.blob()) });
    await image.decode();
    // The switch may have been turned off meanwhile.
    if (!card.hasImage) {
      URL.revokeObjectURL(image.src);
      return;
    }
    if (!card.live.view) find(".sight", card.node).firstChild.replaceWith(image);
    if (card.image) URL.revokeObjectURL(card.image.src);
    card.image = image;
  } catch (problem) {
    // The image of the first frame after the switch may not be there yet.
    if (problem.status === 404) card.hasImage = Boolean(card.info?.keep_image);
  } finally {
    card.isAsking = false;
  }
}

/** Shows the state of a camera that this server reads; `info` is null for one that only sends frames. */
export async function drawTools(card, info) {
  const before = card.info;
  card.info = info;
  const text = stateOf(info);
  if (card.state.textContent !== text) card.state.textContent = text;
  card.state.classList.toggle("failing", Boolean(info?.problem));
  if (info?.keep_image) card.hasImage = true;
  else if (before?.keep_image) dropImage(card);
  showSuggestion(card);
  const { can_change: may } = await options();
  const isManaged = Boolean(may && info);
  card.remedy.hidden = !(isManaged && info.stored && info.warning && (info.every || info.profile));
  const isSame = before?.paused === info?.paused && before?.keep_image === info?.keep_image;
  if (Boolean(card.manage.firstChild) === isManaged && isSame) return;
  card.manage.replaceChildren(...(isManaged ? managing(card) : []));
}

function stateOf(info) {
  if (!info) return "";
  if (info.paused) return "Paused: no frames are read.";
  if (info.problem) return `No frames: ${info.problem}`;
  return info.warning ?? info.choice ?? "";
}

const pathOf = ({ camera }) => `cameras/${encodeURIComponent(camera)}`;

/** Does something with a camera, with its progress in the card, and reads its state again. */
const acting = (card) => (label, work) => shown(async () => {
  await withProgress(card.strip, label, work);
  await card.reread();
});

/** Saves the camera without its rate and profile. Its URL and password stay. */
const chooseAutomatically = (card) => acting(card)("Saving", () => {
  const { user, calibration, keep_image } = card.info;
  return ask(pathOf(card), { method: "PUT", body: JSON.stringify({ user, calibration, keep_image }) });
});

function managing(card) {
  const { camera, info } = card;
  const [path, act] = [pathOf(card), acting(card)];
  const patch = (change) => ask(path, { method: "PATCH", body: JSON.stringify(change) });
  const pause = () => patch({ paused: !card.info.paused });
  const keep = element("input", { type: "checkbox", checked: info.keep_image, onchange: act("Saving", () => patch({ keep_image: keep.checked })) });
  const note = element("p", { class: "muted", hidden: info.keep_image });
  retention().then((text) => (note.textContent = text));
  const keeping = element("div", { class: "keeping" }, element("label", { class: "check" }, keep, " Keep the latest image"), note);
  const remove = () => confirm(`Remove the camera ${camera}? The history of its counts stays.`) && act("Removing", () => ask(path, { method: "DELETE" }))();
  const clear = () => confirm(`Delete the history of the counts of ${camera}? It is counted on from now.`) && act("Deleting", () => ask(`counts/${encodeURIComponent(camera)}`, { method: "DELETE" }))();
  const button = (label, onclick) => element("button", { type: "button", class: "quiet", onclick }, label);
  const pausing = button(info.paused ? "Resume" : "Pause", act("Saving", pause));
  // A camera of the settings is changed and removed there.
  const clearing = button("Delete its history", clear);
  const buttons = info.stored ? [button("Settings", () => card.onchange(card.info)), pausing, button("Remove", remove), clearing] : [pausing, clearing];
  return [...buttons, keeping];
}

/** Removes the image of a card whose images are no longer kept. */
function dropImage(card) {
  if (card.image) URL.revokeObjectURL(card.image.src);
  Object.assign(card, { image: null, hasImage: false });
  find(".sight > img", card.node)?.replaceWith(sketch(card.report));
}

export function tellAge({ age, reportedAt }) {
  if (!reportedAt) return;
  const seconds = Math.max(0, Math.round((Date.now() - reportedAt) / 1000));
  const [value, unit] = seconds < 60 ? [seconds, "s"] : seconds < 3600 ? [Math.floor(seconds / 60), "min"] : [Math.floor(seconds / 3600), "h"];
  age.textContent = seconds < 2 ? "now" : `${value} ${unit} ago`;
}
