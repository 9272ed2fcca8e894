/** A live straight view in the card of one camera: a direction that is dragged, a panorama, or the quarters. */

import { element, find } from "./dom.js";
import { shown, withProgress } from "./progress.js";
import { ask } from "./server.js";

/** The kinds of views by the label of their button; the disc is the frame itself. */
const KINDS = {
  Disc: null,
  Straight: { kind: "fixed", azimuth_deg: 90, tilt_deg: 45, field_of_view_deg: 90, width: 960, height: 720 },
  Panorama: { kind: "panorama", azimuth_deg: 90, width: 1600, height: 480 },
  Quarters: { kind: "quarters", azimuth_deg: 0, width: 1280, height: 960 },
};
/** The pause after a frame that is not new, and after a problem. */
const [PAUSE_MILLIS, RETRY_MILLIS] = [150, 2000];
const ZOOM = 1.1;

const clamp = (value, least, most) => Math.min(Math.max(value, least), most);
const pause = (millis) => new Promise((resolve) => setTimeout(resolve, millis));

/** The fields of a view as a query. */
const queryOf = (view) => new URLSearchParams(Object.entries(view).map(([name, value]) => [name, String(value)]));

/** Turns a view by a movement of the pointer, in fractions of the width of its image. */
export function turned(view, right, down) {
  const span = view.kind === "fixed" ? view.field_of_view_deg : 360;
  const azimuth = (((view.azimuth_deg - right * span) % 360) + 360) % 360;
  const tilt = view.kind === "fixed" ? { tilt_deg: clamp(view.tilt_deg + down * span, 0, 90) } : {};
  return { ...view, azimuth_deg: azimuth, ...tilt };
}

/** Zooms into a direction (`steps` above 0) or out. */
export function zoomed(view, steps) {
  if (view.kind !== "fixed") return view;
  return { ...view, field_of_view_deg: clamp(view.field_of_view_deg / ZOOM ** steps, 10, 150) };
}

/** Adds the buttons of the kinds to a card. */
export function addViews(card) {
  const { camera } = card;
  const image = element("img", { class: "live-view", alt: `A straight view of ${camera}`, draggable: false });
  const note = element("p", { class: "muted", role: "status" });
  const keep = element("button", { type: "button", onclick: shown(() => keepView(card)) }, "Keep this view");
  const share = element("button", { type: "button", onclick: shown(() => copyAddress(card)) }, "Address for others");
  const tools = element("span", { hidden: true }, keep, share);
  const kinds = Object.keys(KINDS).map((label) => element("button", { type: "button", "aria-pressed": String(label === "Disc"), onclick: () => choose(card, label) }, label));
  const group = element("div", { class: "live-views", role: "group", "aria-label": `Views of ${camera}`, hidden: true }, ...kinds, tools, note);
  card.live = { group, image, note, tools, kinds, view: null, name: "" };
  image.addEventListener("pointerdown", (event) => drag(card.live, event));
  image.addEventListener("wheel", (event) => {
    event.preventDefault();
    change(card.live, zoomed(card.live.view, -Math.sign(event.deltaY)));
  });
  return group;
}

function choose(card, label) {
  const { live } = card;
  for (const button of live.kinds) button.setAttribute("aria-pressed", String(button.textContent === label));
  const wasShown = live.view !== null;
  change(live, KINDS[label]);
  live.note.textContent = "";
  live.tools.hidden = !live.view;
  const before = find(".sight", card.node)?.firstChild;
  if (live.view && !wasShown) {
    live.replaced = before;
    before?.replaceWith(live.image);
    showFrames(card);
  } else if (!live.view && wasShown) {
    live.image.replaceWith(card.image ?? live.replaced);
  }
}

function change(live, view) {
  live.view = view;
  live.name = "";
}

function drag(live, start) {
  start.preventDefault();
  const { image } = live;
  image.setPointerCapture(start.pointerId);
  let last = start;
  const move = (event) => {
    const width = image.clientWidth || 1;
    change(live, turned(live.view, (event.clientX - last.clientX) / width, (event.clientY - last.clientY) / width));
    last = event;
  };
  image.addEventListener("pointermove", move);
  image.addEventListener("lostpointercapture", () => image.removeEventListener("pointermove", move), { once: true });
}

/** Shows the newest frame in the view, again and again while it is chosen and the card is in the page. */
async function showFrames(card) {
  const { live } = card;
  let tag = "";
  while (live.view && live.image.isConnected) {
    try {
      const headers = tag ? { "If-None-Match": tag } : {};
      const answer = await ask(`cameras/${encodeURIComponent(card.camera)}/views/page.jpg?${queryOf(live.view)}`, { headers });
      tag = answer.headers.get("etag");
      const before = live.image.src;
      live.image.src = URL.createObjectURL(await answer.blob());
      if (before) URL.revokeObjectURL(before);
      await live.image.decode();
      live.note.textContent = "";
    } catch (problem) {
      if (problem.status !== 304) live.note.textContent = problem.message;
      await pause(problem.status === 304 ? PAUSE_MILLIS : RETRY_MILLIS);
    }
  }
}

/** Stores the view under a name. */
async function keepView({ camera, live, strip }) {
  const name = prompt("Name of the view: a-z, 0-9, _ and -");
  if (!name) return;
  const path = `cameras/${encodeURIComponent(camera)}/views/${encodeURIComponent(name)}`;
  await withProgress(strip, "Saving", () => ask(path, { method: "PUT", body: JSON.stringify(live.view) }));
  live.name = name;
  live.note.textContent = `The view ${name} is kept.`;
}

/** Copies the address of the stored view for players and other pages. */
async function copyAddress(card) {
  if (!card.live.name) await keepView(card);
  if (!card.live.name) return;
  const path = `cameras/${encodeURIComponent(card.camera)}/views/${card.live.name}.mjpg`;
  const address = new URL(path, document.baseURI).href;
  await navigator.clipboard?.writeText(address);
  card.live.note.textContent = `${address} — on a server with keys, add ?key= and a key of the scope view.`;
}
