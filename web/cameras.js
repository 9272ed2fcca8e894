/** The section Cameras: a card for each camera, updated by events, and the camera of the address `#camera/NAME` alone. */

import { addCard, drawCard, drawTools, removeCard, tellAge } from "./camera_card.js";
import { openForm, startForm } from "./camera_form.js";
import { followStates, options } from "./camera_states.js";
import { followCounts } from "./counts.js";
import { element, find } from "./dom.js";
import { forgetKey } from "./ignore_place.js";
import { countedNumbers } from "./plot.js";
import { shown, showFailure, withProgress } from "./progress.js";
import { askJson, events } from "./server.js";

/** The maximum number of cards; cameras with the latest reports come first. */
const MAX_CARDS = 60;
/** The number of steps in a plot. */
const MAX_HISTORY = 100;
/** The time before now of which the counts are drawn. */
const COUNTED_MILLIS = 30 * 60_000;
/** The pause between the end of a stream and the next attempt. */
const PAUSE_MILLIS = 2000;
/** The interval between two updates of the numbers of persons. */
const NUMBERS_MILLIS = 1000;

const cards = new Map();
let listening = null;
let lastId = "";
/** The camera of the address; empty for all cameras. */
let selected = "";
let hasLoaded = false;

/** Reads events until `signal` aborts. After a reconnection the server sends the missed events. */
async function listen(signal) {
  const wall = find("#wall-progress");
  const cameras = await withProgress(wall, "Loading cameras", () => askJson("results", { signal }));
  cameras.sort((one, other) => one.age_seconds - other.age_seconds);
  const known = cameras.slice(0, MAX_CARDS);
  await withProgress(wall, "Loading the history", () => Promise.all(known.map((row) => loadHistory(row, signal))));
  showNumbers(known);
  hasLoaded = true;
  arrange();
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

/** Loads the numbers before now: those of the counts where the number is counted, else those of the reports. */
async function loadHistory({ camera, persons_source: source }, signal) {
  const name = encodeURIComponent(camera);
  const query = new URLSearchParams({ from: new Date(Date.now() - COUNTED_MILLIS).toISOString(), step: "1m" });
  const counts = source === "tracks" ? await askJson(`counts/${name}?${query}`, { signal }).catch(() => null) : null;
  const rows = await askJson(`results/${name}/history?limit=${counts ? 1 : MAX_HISTORY}`, { signal });
  for (const { id, persons, report } of rows) addReport(id, report, persons);
  const card = cards.get(camera);
  const numbers = countedNumbers(counts?.steps ?? []);
  if (numbers.length > 0 && card) card.history = numbers;
}

/** Updates the numbers of all cards until `signal` aborts: the server has one number of each camera. */
async function followNumbers(signal) {
  while (!signal.aborted) {
    await new Promise((resolve) => setTimeout(resolve, NUMBERS_MILLIS));
    // While the server does not respond, the events report it.
    showNumbers(await askJson("results", { signal }).catch(() => []));
  }
}

/** Shows the present numbers of cameras: those of the history are the numbers of their times. */
function showNumbers(rows) {
  for (const { camera, persons, persons_low: low, persons_high: high, received_at: receivedAt } of rows) {
    const card = cards.get(camera);
    if (card) showBar(card, persons === null ? null : [low, high]);
    if (card?.info?.paused) addNumber(card, Date.now(), null);
    else if (card) addNumber(card, Date.parse(receivedAt), persons);
  }
}

/** Shows the error bar of the number of a card. */
function showBar(card, bar) {
  if (String(card.bar) === String(bar)) return;
  card.bar = bar;
  redraw(card);
}

/** Adds a number of persons to a card, null while the camera is paused. Numbers that did not change are one step of its plot. */
function addNumber(card, time, persons) {
  const last = card.history.at(-1);
  card.reportedAt = Math.max(time, card.reportedAt);
  const slow = persons !== null && card.isTooLow;
  if (last?.persons === persons && Boolean(last.slow) === slow) return;
  card.history.push({ time: Math.max(time, last?.time ?? 0), persons, slow });
  card.history.splice(0, card.history.length - MAX_HISTORY);
  redraw(card);
}

/** Draws a card once for many simultaneous changes. */
function redraw(card) {
  card.drawn ||= requestAnimationFrame(() => drawCard(card, [...cards.values()]));
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
  if (cards.size >= MAX_CARDS) {
    const [oldest] = [...cards.values()].sort((one, other) => Number(one.id) - Number(other.id));
    dropped(oldest);
  }
  const card = addCard(camera, { onchange: (info) => openForm(info, readStates), reread: readStates });
  cards.set(camera, card);
  const after = [...cards.values()].filter((other) => other.camera > camera);
  after.sort((one, other) => (one.camera < other.camera ? -1 : 1));
  find("#wall").insertBefore(card.node, after[0]?.node ?? null);
  redraw(card);
  arrange();
  return card;
}

function dropped(card) {
  removeCard(card);
  cards.delete(card.camera);
  arrange();
}

/** Shows the states of the cameras that this server reads. */
function showStates(rows) {
  const named = new Map(rows.map((row) => [row.name, row]));
  for (const row of rows) {
    const card = cards.get(row.name) ?? added(row.name);
    drawTools(card, row);
  }
  for (const card of cards.values()) {
    if (named.has(card.camera)) continue;
    // The camera was removed.
    if (card.info) dropped(card);
  }
}

let readStates = () => {};

/** Shows all cards, or the selected one; a single card fills the width. */
function arrange() {
  const wall = find("#wall");
  const isSingle = Boolean(selected) || cards.size === 1;
  wall.classList.toggle("single", isSingle);
  wall.classList.toggle("selected", Boolean(selected));
  for (const card of cards.values()) {
    const wasSingle = card.isSingle;
    card.node.hidden = Boolean(selected) && card.camera !== selected;
    card.isSingle = isSingle && !card.node.hidden;
    if (card.isSingle !== wasSingle) redraw(card);
  }
  const isMissing = selected ? hasLoaded && !cards.has(selected) : hasLoaded && cards.size === 0;
  find("#wall-empty").hidden = !isMissing;
  if (isMissing) showHelp();
  find("#title-cameras").textContent = selected || "Cameras";
  find("#all-cameras").hidden = !selected;
  find("#cameras-lead").hidden = Boolean(selected);
}

/** How a camera appears here. */
async function showHelp() {
  const { has_cameras: reads, can_change: may } = await options();
  const text = selected ? [`There is no camera ${selected}.`] : reads && may ? ["No camera yet: add the first one."] : helpOf(reads);
  find("#wall-help").replaceChildren(...text);
  find("#first-camera").hidden = !(reads && may) || Boolean(selected);
}

function helpOf(reads) {
  if (reads) return ["No camera yet. A key with the scope ", element("code", {}, "admin"), " adds one here."];
  const run = element("code", {}, "lookdown run rtsp://10.0.0.8:554/stream2 --name hall");
  const send = element("code", {}, "POST /detect?camera=hall");
  return ["No camera yet. ", run, " reads one; a frame sent with ", send, " appears, too."];
}

const listenShown = shown(listen);

/** Shows or hides the section; `camera` is that of the address. */
export function visible(is, camera = "") {
  selected = is ? camera : "";
  if (is === !listening) followCounts(is);
  if (!is) {
    listening?.abort();
    listening = null;
  } else if (!listening) {
    listening = new AbortController();
    listenShown(listening.signal);
    followNumbers(listening.signal);
    readStates = followStates(showStates, listening.signal);
  }
  if (is) arrange();
}

export function restart() {
  if (!listening) return;
  forgetKey();
  const camera = selected;
  visible(false);
  visible(true, camera);
}

export function start() {
  setInterval(() => listening && cards.forEach(tellAge), 1000);
  startForm();
  const add = () => openForm(null, readStates);
  for (const id of ["#add-camera", "#first-camera"]) find(id).addEventListener("click", add);
}
