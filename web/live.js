/** The section Live: a card for each camera, updated by events. */

import { addCounts, followCounts, layersBelow } from "./counts.js";
import { element, find } from "./dom.js";
import { addBoxes, forgetKey } from "./ignore_place.js";
import { sketch } from "./marks.js";
import { stepPlot } from "./plot.js";
import { shown, showFailure, withProgress } from "./progress.js";
import { ask, askJson, events } from "./server.js";

/** The maximum number of cards; cameras with the latest reports come first. */
const MAX_CARDS = 60;
/** The number of steps in a plot. */
const MAX_HISTORY = 100;
/** The pause between the end of a stream and the next attempt. */
const PAUSE_MILLIS = 2000;
/** The interval between two updates of the numbers of persons. */
const NUMBERS_MILLIS = 1000;

const cards = new Map();
let listening = null;
let lastId = "";

/** Reads events until `signal` aborts. After a reconnection the server sends the missed events. */
async function listen(signal) {
  const wall = find("#wall-progress");
  const cameras = await withProgress(wall, "Loading cameras", () => askJson("results", { signal }));
  cameras.sort((one, other) => one.age_seconds - other.age_seconds);
  const known = cameras.slice(0, MAX_CARDS);
  await withProgress(wall, "Loading the history", () => Promise.all(known.map((row) => loadHistory(row, signal))));
  find("#wall-empty").hidden = cards.size > 0;
  while (!signal.aborted) {
    try {
      const headers = lastId ? { "Last-Event-ID": lastId } : {};
      for await (const { id, data } of events("events", { headers, signal })) {
        showFailure(wall, "");
        addReport(id, JSON.parse(data));
      }
    } catch (error) {
      if (signal.aborted) return;
      showFailure(wall, `${error.message} Trying again.`);
    }
    await new Promise((resolve) => setTimeout(resolve, PAUSE_MILLIS));
  }
}

async function loadHistory({ camera }, signal) {
  const rows = await askJson(`results/${encodeURIComponent(camera)}/history?limit=${MAX_HISTORY}`, { signal });
  for (const { id, persons, report } of rows) addReport(id, report, persons);
}

/** Updates the numbers of all cards until `signal` aborts: the server has one number of each camera. */
async function followNumbers(signal) {
  while (!signal.aborted) {
    await new Promise((resolve) => setTimeout(resolve, NUMBERS_MILLIS));
    // While the server does not respond, the events report it.
    const rows = await askJson("results", { signal }).catch(() => []);
    for (const { camera, persons, received_at: receivedAt } of rows) {
      const card = cards.get(camera);
      if (card) addNumber(card, Date.parse(receivedAt), persons);
    }
  }
}

/** Adds a number of persons to a card. Numbers that did not change are one step of its plot. */
function addNumber(card, time, persons) {
  const last = card.history.at(-1);
  card.reportedAt = Math.max(time, card.reportedAt);
  if (last?.persons === persons) return;
  card.history.push({ time: Math.max(time, last?.time ?? 0), persons });
  card.history.splice(0, card.history.length - MAX_HISTORY);
  redraw(card);
}

/** Draws a card once for many simultaneous changes. */
function redraw(card) {
  card.drawn ||= requestAnimationFrame(() => draw(card));
}

/** Adds a report to its card; ignores known reports. The number of an event follows from the next update. */
function addReport(id, report, persons) {
  const card = cards.get(report.camera) ?? added(report.camera);
  if (Number(id) <= Number(card.id)) return;
  if (Number(id) > Number(lastId)) lastId = id;
  card.id = id;
  card.report = report;
  const time = Date.parse(report.received_at);
  card.reportedAt = Math.max(time, card.reportedAt);
  // The number after the first report of a camera is that of the report.
  if (persons !== undefined || card.history.length === 0) addNumber(card, time, persons ?? report.persons.length);
  redraw(card);
}

function added(camera) {
  const node = element("article", { class: "card", "aria-label": `Camera ${camera}`, "data-camera": camera });
  const card = { camera, node, id: "0", history: [], reportedAt: 0, report: null, drawn: 0, picture: null, hasPicture: true, isAsking: false, message: null };
  if (cards.size >= MAX_CARDS) {
    const [oldest] = [...cards.values()].sort((one, other) => Number(one.id) - Number(other.id));
    oldest.node.remove();
    if (oldest.picture) URL.revokeObjectURL(oldest.picture.src);
    cards.delete(oldest.camera);
  }
  cards.set(camera, card);
  const after = [...cards.values()].filter((other) => other.camera > camera);
  after.sort((one, other) => (one.camera < other.camera ? -1 : 1));
  find("#wall").insertBefore(node, after[0]?.node ?? null);
  find("#wall-empty").hidden = true;
  return card;
}

function draw(card) {
  card.drawn = 0;
  const { report, history } = card;
  const count = history.at(-1).persons;
  const zones = report.zones?.map(({ name, persons }) => element("li", {}, `${name} `, element("b", {}, String(persons))));
  const focused = card.node.contains(document.activeElement) ? document.activeElement.dataset.box : undefined;
  card.age = element("span", { class: "age" });
  card.node.replaceChildren(
    element("header", {}, element("h2", {}, card.camera), card.age),
    element("div", { class: "sight" }, card.picture ?? sketch(report), element("p", { class: "big" }, element("b", {}, String(count)), count === 1 ? "person" : "persons")),
    zones ? element("ul", { class: "zones" }, zones) : "",
    stepPlot(history, Date.now()),
  );
  tellAge(card);
  showPicture(card);
  addCounts(card);
  if (card.message) find(".sight", card.node).after(card.message);
  addBoxes(card, [...cards.values()], focused);
}

/** Replaces the sketch by the image of the latest report, if the server stores images of this camera. */
async function showPicture(card) {
  if (!card.hasPicture || card.isAsking) return;
  card.isAsking = true;
  try {
    const answer = await ask(`results/${encodeURIComponent(card.camera)}/latest.jpg?draw=${layersBelow(card)}&width=480`);
    const picture = element("img", { alt: `The latest frame of ${card.camera}`, src: URL.createObjectURL(await answer.blob()) });
    await picture.decode();
    find(".sight", card.node).firstChild.replaceWith(picture);
    if (card.picture) URL.revokeObjectURL(card.picture.src);
    card.picture = picture;
  } catch (problem) {
    if (problem.status === 404) card.hasPicture = false;
  } finally {
    card.isAsking = false;
  }
}

function tellAge({ age, reportedAt }) {
  if (!age) return;
  const seconds = Math.max(0, Math.round((Date.now() - reportedAt) / 1000));
  const [value, unit] = seconds < 60 ? [seconds, "s"] : seconds < 3600 ? [Math.floor(seconds / 60), "min"] : [Math.floor(seconds / 3600), "h"];
  age.textContent = seconds < 2 ? "now" : `${value} ${unit} ago`;
}

const listenShown = shown(listen);

export function visible(is) {
  if (is === !listening) followCounts(is);
  if (!is) {
    listening?.abort();
    listening = null;
  } else if (!listening) {
    listening = new AbortController();
    listenShown(listening.signal);
    followNumbers(listening.signal);
  }
}

export function restart() {
  if (!listening) return;
  forgetKey();
  visible(false);
  visible(true);
}

export function start() {
  setInterval(() => listening && cards.forEach(tellAge), 1000);
}
