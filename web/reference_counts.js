/** The question "How many are there now?" at a camera: the answers of people teach its number and its error bar. */

import { options } from "./camera_states.js";
import { element, plural } from "./dom.js";
import { sketch } from "./marks.js";
import { shown, withProgress } from "./progress.js";
import { ask, askJson } from "./server.js";

/** The width of the image in pixels: small people must be seen. */
const WIDTH = 1200;
/** The interval between two updates of the answers. */
const MILLIS = 10_000;
/** The attempts to get a new frame, and the pause between two. */
const [ATTEMPTS, PAUSE_MILLIS] = [20, 500];
const MOMENTS = { busy: "It is busy now", empty: "It is empty now", other_hour: "At this hour it was never asked", unsure: "The number is unsure now" };

/** Creates the question of a card: `{node, refresh}`. `refresh` reads the answers so far, not too often. */
export function teaching(card) {
  const node = element("section", { class: "teach", "aria-label": `Number of people in ${card.camera}`, hidden: true });
  const question = element("div");
  const status = element("p", { class: "muted", role: "status" });
  const list = element("details", { hidden: true });
  node.append(question, status, list);
  const parts = { card, node, question, status, list, path: `cameras/${encodeURIComponent(card.camera)}/reference-counts` };
  close(parts);
  let readAt = 0;
  const refreshSoon = () => {
    node.hidden ||= !card.isSingle;
    if (!card.isSingle || Date.now() - readAt < MILLIS) return;
    readAt = Date.now();
    refresh(parts);
  };
  return { node, refresh: refreshSoon };
}

/** Shows the button that asks. */
function close(parts) {
  const start = busy(parts, () => open(parts));
  parts.question.replaceChildren(element("button", { type: "button", onclick: start }, "How many are there now?"));
}

/** Does something without the question, so that nothing is answered twice. After a failure, it can be asked again. */
function busy(parts, work) {
  return shown(async () => {
    parts.question.replaceChildren();
    await work().catch((problem) => {
      close(parts);
      throw problem;
    });
  });
}

async function refresh(parts) {
  const { card, node, path } = parts;
  const { can_change: may } = await options();
  // Without a stored report, nothing can be asked.
  const answers = may && card.isSingle && card.report ? await askJson(path).catch(() => null) : null;
  node.hidden = !answers;
  if (answers) show(parts, answers);
  return answers;
}

function show(parts, { counts, counts_wanted: wanted, score_threshold: threshold, moment }) {
  const { card, status, list, path } = parts;
  const missing = wanted - counts.length;
  const state = missing > 0
    ? `${plural(missing, "more answer")} and the number learns from you; until then its error is a guess from rendered rooms.`
    : `The number has learned from ${counts.length} answers: it counts people from a score of ${threshold} on.`;
  status.textContent = moment in MOMENTS ? `${state} ${MOMENTS[moment]}: an answer helps.` : state;
  list.hidden = counts.length === 0;
  const remove = (report) => shown(async () => {
    await withProgress(status, "Deleting", () => ask(`${path}/${report}`, { method: "DELETE" }));
    await refresh(parts);
  });
  const row = ({ report, at, persons }) => {
    const text = `${plural(persons, "person")}, ${new Date(at).toLocaleString()}`;
    return element("li", {}, `${text} `, element("button", { type: "button", class: "quiet", "aria-label": `Delete: ${text} in ${card.camera}`, onclick: remove(report) }, "Delete"));
  };
  list.replaceChildren(element("summary", {}, plural(counts.length, "answer")), element("ul", {}, counts.toReversed().map(row)));
}

/** Shows a frame with the people found, and asks for their number. */
async function open(parts) {
  const { card, question } = parts;
  const { report, image } = await withProgress(parts.status, "Reading the frame", () => newFrameOf(card, parts.answered));
  let persons = card.history.at(-1)?.persons ?? card.report.persons.length;
  const number = element("output", { "aria-label": "People in this frame" });
  const change = (by) => () => {
    persons = Math.max(0, persons + by);
    number.textContent = String(persons);
  };
  change(0)();
  const button = (text, onclick, label) => element("button", { type: "button", "aria-label": label, onclick }, text);
  const buttons = [
    button("−", change(-1), "One fewer"),
    number,
    button("+", change(1), "One more"),
    button("Right", busy(parts, () => answer(parts, report, persons))),
    button("Cancel", () => close(parts)),
  ];
  question.replaceChildren(image, element("div", { class: "row" }, buttons));
}

/** Stores an answer, and asks again until there are enough. */
async function answer(parts, report, persons) {
  const body = JSON.stringify({ persons });
  await withProgress(parts.status, "Saving", () => ask(`${parts.path}/${report}`, { method: "PUT", body }));
  parts.answered = report;
  const answers = await refresh(parts);
  if (answers && answers.counts.length < answers.counts_wanted) await open(parts);
  else close(parts);
}

/** A frame of another report than `answered`, if one comes soon. */
async function newFrameOf(card, answered) {
  let frame = await frameOf(card);
  for (let attempt = 0; attempt < ATTEMPTS && frame.report === answered; attempt += 1) {
    await new Promise((resolve) => setTimeout(resolve, PAUSE_MILLIS));
    frame = await frameOf(card);
  }
  return frame;
}

/** The image of the latest report with its boxes, else the places of its people. */
async function frameOf(card) {
  try {
    const found = await ask(`results/${encodeURIComponent(card.camera)}/latest.jpg?width=${WIDTH}`);
    const image = element("img", { alt: `The frame of ${card.camera} to count people in`, src: URL.createObjectURL(await found.blob()) });
    image.addEventListener("load", () => URL.revokeObjectURL(image.src));
    return { report: found.headers.get("ETag").replaceAll('"', ""), image };
  } catch (problem) {
    if (problem.status !== 404) throw problem;
    return { report: card.id, image: sketch(card.report) };
  }
}
