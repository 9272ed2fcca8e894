/** People on the floor of a camera: a calm red frame, a line for each, and the button that acknowledges it. */

import { options } from "./camera_states.js";
import { element } from "./dom.js";
import { ask } from "./server.js";

/** Creates the alerts of a camera: `{node, show}`. `show` takes the alerts of an answer of the counts, and the node of the card. */
export function floorAlerts(camera) {
  const node = element("div", { class: "floor-alerts", role: "alert", hidden: true });
  return { node, show: (alerts = [], card = null) => show({ camera, node }, alerts, card) };
}

async function show({ camera, node }, alerts, card) {
  card?.classList.toggle("has-floor-alert", alerts.some(({ is_acknowledged: isAcknowledged }) => !isAcknowledged));
  const rows = alerts.map((alert) => ({ id: alert.id, text: textOf(alert), isOpen: !alert.is_acknowledged }));
  const content = JSON.stringify(rows);
  // Buttons stay where they are until something changes.
  if (node.dataset.content === content) return;
  node.dataset.content = content;
  node.hidden = !rows.length;
  const { can_change: may } = await options();
  node.replaceChildren(...rows.map((row) => element("p", {}, element("span", {}, row.text), ...(may && row.isOpen ? [button(camera, row)] : []))));
}

/** The sentence of an alert, such as "Someone is lying near window since 14:02". */
export function textOf({ posture, zone, since, is_acknowledged: isAcknowledged }) {
  const time = new Date(since).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" });
  const what = posture === "lying" ? "lying" : "on the floor";
  return `Someone is ${what}${zone ? ` near ${zone}` : ""} since ${time}${isAcknowledged ? ", acknowledged" : ""}`;
}

function button(camera, { id, text }) {
  const acknowledge = async ({ target }) => {
    target.disabled = true;
    try {
      await ask(`counts/${encodeURIComponent(camera)}/floor/${id}`, { method: "PUT" });
    } catch (problem) {
      target.disabled = false;
      target.after(element("span", { class: "failure", role: "status" }, `Not acknowledged: ${problem.message}`));
    }
  };
  // The label begins with the text, so that a voice can press the button.
  return element("button", { type: "button", "aria-label": `Acknowledge: ${text}, ${camera}`, onclick: acknowledge }, "Acknowledge");
}
