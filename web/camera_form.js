/** The dialog that adds a camera or changes its settings, with a test that shows its first frame. */

import { retention } from "./camera_states.js";
import { element, find } from "./dom.js";
import { shown, showFailure, withProgress } from "./progress.js";
import { ask } from "./server.js";
import { shared } from "./shared.js";

/** The URLs of common makers; the address of the camera replaces HOST. The second stream is small enough for most frames. */
const MAKERS = [
  ["Amcrest, Dahua", "rtsp://HOST:554/cam/realmonitor?channel=1&subtype=1"],
  ["Axis", "rtsp://HOST:554/axis-media/media.amp"],
  ["Bosch", "rtsp://HOST:554/?inst=2"],
  ["Hanwha", "rtsp://HOST:554/profile2/media.smp"],
  ["Hikvision", "rtsp://HOST:554/Streaming/Channels/102"],
  ["Mobotix", "http://HOST/record/current.jpg"],
  ["Reolink", "rtsp://HOST:554/h264Preview_01_sub"],
  ["TP-Link", "rtsp://HOST:554/stream2"],
  ["Ubiquiti", "rtsps://HOST:7441/TOKEN"],
  ["Uniview", "rtsp://HOST:554/media/video2"],
  ["Vivotek", "rtsp://HOST:554/live2.sdp"],
];

/** The camera that is changed; null for a new one. */
let edited = null;
let saved = () => {};
let testing = null;
let frame = "";

const form = () => find("#camera-form");
const field = (name) => form().elements[name];

/** Opens the dialog for a camera of the server, or for a new one; `then` runs after it is saved. */
export function openForm(info, then) {
  edited = info;
  saved = then;
  form().reset();
  find("#title-camera-form").textContent = info ? `Settings of ${info.name}` : "Add a camera";
  field("name").value = info?.name ?? "";
  field("name").readOnly = Boolean(info);
  field("url").required = !info;
  field("url").placeholder = info ? info.source : "rtsp://10.0.0.8:554/stream2";
  field("user").value = info?.user ?? "";
  field("password").placeholder = info?.user ? "unchanged" : "";
  find("#camera-kept").hidden = !info;
  const choice = field("calibration");
  choice.replaceChildren(choice.firstElementChild, ...shared.calibrations.map(({ id }) => element("option", { value: id }, id)));
  for (const name of ["every", "profile", "calibration"]) choose(field(name), info?.[name] ?? "");
  field("keep_image").checked = info?.keep_image ?? true;
  retention().then((text) => (find("#camera-kept-image").textContent = text));
  showFrame(null);
  for (const host of ["#camera-test", "#camera-save"]) showFailure(find(host), "");
  find("#camera-dialog").showModal();
}

/** Chooses a value, which is added if it is not among the choices. */
function choose(choice, value) {
  if (![...choice.options].some((option) => option.value === value)) choice.append(element("option", { value }, value));
  choice.value = value;
}

/** The camera as the API has it. Empty fields are left out, so that the stored URL and password stay. */
function camera() {
  const names = ["url", "user", "password", "every", "calibration", "profile"];
  const given = names.map((name) => [name, field(name).value.trim()]).filter(([, value]) => value);
  return { ...Object.fromEntries(given), keep_image: field("keep_image").checked, paused: edited?.paused ?? false };
}

/** The nearest name that a camera may have, such as `my-cam` for `My Cam`. */
export const plainName = (text) => text.trim().toLowerCase().replace(/[^a-z0-9_-]+/g, "-").replace(/^[-_]+/, "");

async function test() {
  testing?.abort();
  testing = new AbortController();
  showFrame(null);
  const { signal } = testing;
  const isStored = edited && !field("url").value && !field("password").value;
  const first = isStored
    ? () => ask(`cameras/${encodeURIComponent(edited.name)}/frame.jpg`, { signal })
    : () => ask("cameras/test", { method: "POST", body: JSON.stringify(camera()), signal });
  if (!isStored && !field("url").reportValidity()) return;
  if (!isStored && !field("url").value) {
    showFailure(find("#camera-test"), "Give the URL again to test it with another password.");
    return;
  }
  const answer = await withProgress(find("#camera-test"), "Waiting for the first frame", first);
  showFrame(await answer.blob());
}

function showFrame(blob) {
  URL.revokeObjectURL(frame);
  frame = blob ? URL.createObjectURL(blob) : "";
  const image = find("#camera-frame");
  image.hidden = !blob;
  find("#camera-works").hidden = !blob;
  if (!blob) return;
  image.onload = () => (find("#camera-works").textContent = `It works: ${image.naturalWidth} × ${image.naturalHeight} pixels.`);
  image.src = frame;
}

async function save() {
  const name = field("name").value.trim();
  const options = { method: "PUT", body: JSON.stringify(camera()), headers: { "Content-Type": "application/json" } };
  await withProgress(find("#camera-save"), "Saving", () => ask(`cameras/${encodeURIComponent(name)}`, options));
  find("#camera-dialog").close();
  await saved();
  location.hash = `camera/${encodeURIComponent(name)}`;
}

export function startForm() {
  const pick = (url) => () => {
    const host = /^\w+:\/\/([^/:?]+)/.exec(field("url").value)?.[1] ?? "HOST";
    field("url").value = url.replace("HOST", host);
    field("url").focus();
  };
  find("#makers").replaceChildren(
    ...MAKERS.map(([maker, url]) => element("li", {}, element("span", {}, maker), element("button", { type: "button", class: "quiet", onclick: pick(url) }, url))),
  );
  field("name").addEventListener("change", ({ target }) => (target.value = plainName(target.value)));
  find("#camera-try").addEventListener("click", shown(test));
  find("#camera-cancel").addEventListener("click", () => find("#camera-dialog").close());
  find("#camera-dialog").addEventListener("close", () => {
    testing?.abort();
    field("password").value = "";
  });
  form().addEventListener("submit", (event) => {
    event.preventDefault();
    shown(save)();
  });
}
