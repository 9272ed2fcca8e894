/** What stands at one place for hours in a camera: a list below its image, with the decisions of the user. */

import { options } from "./camera_states.js";
import { element, plural } from "./dom.js";
import { ask } from "./server.js";

const [MINUTE_SECONDS, HOUR_SECONDS] = [60, 3600];
const COUNTED = "candidate";

/** Creates the list of a camera: `{node, show}`. `show` takes the furniture of an answer of the counts. */
export function furnitureList(camera) {
  const summary = element("summary");
  const list = element("ul");
  const message = element("p", { role: "status", class: "muted" });
  const node = element("details", { class: "furniture", hidden: true }, summary, list, message);
  return { node, show: (furniture = []) => show({ camera, node, summary, list, message }, furniture) };
}

async function show({ camera, node, summary, list, message }, furniture) {
  const rows = furniture.map(({ id, state, present_seconds: seconds }) => ({ id, state, time: timeOf(seconds) }));
  const content = JSON.stringify(rows);
  // Buttons stay where they are until something changes.
  if (node.dataset.content === content) return;
  node.dataset.content = content;
  node.hidden = !rows.length;
  const hidden = rows.filter(({ state }) => state !== COUNTED).length;
  summary.textContent = hidden ? `${plural(hidden, "thing")} not counted` : `${plural(rows.length, "person")} standing still`;
  const { can_change: may } = await options();
  list.replaceChildren(...rows.map((row) => element("li", {}, element("span", {}, textOf(row)), ...(may ? buttons(camera, row, message) : []))));
}

const textOf = ({ id, state, time }) => `${id}: ${state === COUNTED ? "counted, stands still" : "not counted, furniture"} for ${time}`;

function timeOf(seconds) {
  return seconds < HOUR_SECONDS ? `${Math.floor(seconds / MINUTE_SECONDS)} min` : `${Math.floor(seconds / HOUR_SECONDS)} h`;
}

function buttons(camera, { id, state }, message) {
  const decide = (method, done) => async () => {
    try {
      await ask(`cameras/${encodeURIComponent(camera)}/furniture/${id}`, { method });
      message.textContent = done;
    } catch (problem) {
      message.textContent = `Not saved: ${problem.message}`;
    }
  };
  // The label begins with the text, so that a voice can press the button.
  const button = (text, onclick) => element("button", { type: "button", class: "quiet", "aria-label": `${text}: thing ${id} of ${camera}`, onclick }, text);
  const confirm = button("Not a person", decide("PUT", `${id} is furniture and is not counted.`));
  const takeBack = button("Is a person", decide("DELETE", `${id} counts as a person.`));
  return state === "confirmed" ? [takeBack] : [confirm, takeBack];
}
