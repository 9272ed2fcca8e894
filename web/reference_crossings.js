/** The crossings of an hour, counted by a person at a camera: they teach how many the camera misses or invents. */

import { options } from "./camera_states.js";
import { element, plural } from "./dom.js";
import { shown, withProgress } from "./progress.js";
import { ask, askJson } from "./server.js";

/** The least known time of an hour that is offered, seconds, as the server has it. */
const LEAST_KNOWN_SECONDS = 3240;
const hourOf = (from) => `${new Date(from).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" })}, one hour`;

/** Creates the question of a card: `{node, refresh}`. `refresh` shows it for a camera with counted lines. */
export function crossingTeaching(card) {
  const node = element("section", { class: "teach", "aria-label": `Crossings of ${card.camera}`, hidden: true });
  const question = element("div");
  const status = element("p", { class: "muted", role: "status" });
  const list = element("details", { hidden: true });
  node.append(question, status, list);
  const parts = { card, node, question, status, list, path: `counts/${encodeURIComponent(card.camera)}/reference-crossings` };
  close(parts);
  return { node, refresh: () => refresh(parts) };
}

function close(parts) {
  parts.question.replaceChildren(element("button", { type: "button", onclick: () => open(parts) }, "Count the crossings of an hour"));
}

async function refresh(parts) {
  const { card, node, status, list } = parts;
  const { can_change: may } = await options();
  const hasLines = may && card.isSingle && Object.keys(card.today?.lines ?? {}).length > 0;
  const answer = hasLines ? await askJson(parts.path).catch(() => null) : null;
  node.hidden = !answer;
  if (!answer) return;
  const hours = Object.groupBy(answer.crossings, ({ from }) => from);
  const ratios = Object.entries(answer.ratios).map(([line, ratio]) => `${line} × ${ratio.toFixed(2)}`);
  status.textContent = ratios.length ? `Sums of crossings have learned from you: ${ratios.join(", ")}.` : "Until someone counts an hour, the error of sums of crossings is a guess.";
  list.hidden = ratios.length === 0;
  const remove = (from) => shown(async () => {
    await withProgress(status, "Deleting", () => ask(`${parts.path}/${from}`, { method: "DELETE" }));
    await refresh(parts);
  });
  const row = ([from, counts]) => {
    const text = `${new Date(from).toLocaleString()}: ${counts.map(({ line, direction, crossings, counted }) => `${line} ${direction} ${crossings}, the camera ${counted}`).join("; ")}`;
    return element("li", {}, `${text} `, element("button", { type: "button", class: "quiet", "aria-label": `Delete: ${text}`, onclick: remove(from) }, "Delete"));
  };
  list.replaceChildren(element("summary", {}, plural(Object.keys(hours).length, "hour")), element("ul", {}, Object.entries(hours).toReversed().map(row)));
}

/** Asks for the crossings of an hour of today. */
function open(parts) {
  const { card, question, status } = parts;
  const known = card.dayCounts.steps.filter(({ known_seconds: seconds }) => seconds >= LEAST_KNOWN_SECONDS);
  if (!known.length) {
    status.textContent = "No whole hour of today is counted yet: ask again later.";
    return;
  }
  const hour = element("select", {}, known.toReversed().map(({ from }) => element("option", { value: from }, hourOf(from))));
  const fields = Object.entries(card.today.lines).flatMap(([line, directions]) => Object.keys(directions).map((direction) => {
    const input = element("input", { type: "number", min: 0, max: 10_000, step: 1, required: true });
    return { line, direction, input };
  }));
  const labels = fields.map(({ line, direction, input }) => element("label", {}, `${line}, ${direction} `, input));
  const save = shown(async (event) => {
    event.preventDefault();
    await withProgress(status, "Saving", async () => {
      for (const { line, direction, input } of fields) {
        const query = new URLSearchParams({ line, direction, crossings: input.value });
        await ask(`${parts.path}/${hour.value}?${query}`, { method: "PUT" });
      }
    });
    close(parts);
    await refresh(parts);
  });
  const cancel = element("button", { type: "button", onclick: () => close(parts) }, "Cancel");
  const buttons = element("div", { class: "row" }, element("button", { type: "submit" }, "Save"), cancel);
  question.replaceChildren(element("form", { onsubmit: save }, element("label", {}, "People who crossed from ", hour), ...labels, buttons));
}
