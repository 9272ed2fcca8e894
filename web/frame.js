/** The frame: from a file, the clipboard, a drop or a sample. */

import { element, find } from "./dom.js";
import { chooseSample, leaveSample } from "./parameters.js";
import { showFailure } from "./progress.js";
import { change, shared } from "./shared.js";

/** The longer side of the image for straightened views, pixels. */
const MAX_SIDE = 1600;

/** Decodes an image and makes it the frame. That of a camera has the name `camera`, and `read` gives its present frame. */
export async function show(blob, name, { camera = "", read = null } = {}) {
  let bitmap;
  try {
    bitmap = await createImageBitmap(blob);
  } catch {
    showFailure(find("#stage"), `${name} is not an image that this browser can read: use a JPEG, PNG or WebP file.`);
    return;
  }
  showFailure(find("#stage"), "");
  const scale = Math.min(1, MAX_SIDE / Math.max(bitmap.width, bitmap.height));
  const [width, height] = [bitmap.width, bitmap.height].map((side) => Math.round(side * scale));
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0, width, height);
  if (shared.frame) URL.revokeObjectURL(shared.frame.url);
  change("report", null);
  change("person", null);
  change("frame", {
    blob,
    name,
    camera,
    read,
    url: URL.createObjectURL(blob),
    width: bitmap.width,
    height: bitmap.height,
    pixels: context.getImageData(0, 0, width, height),
  });
}

/** Shows an image of the user, which has not the calibration of a sample. */
function showOwn(file, name) {
  leaveSample();
  return show(file, name);
}

const imageIn = (files) => [...(files ?? [])].find((file) => file.type.startsWith("image/"));

export function start() {
  const input = find("#frame-file");
  input.addEventListener("change", () => {
    const [file] = input.files;
    input.value = "";
    if (file) showOwn(file, file.name);
  });
  document.addEventListener("paste", (event) => {
    const file = imageIn(event.clipboardData?.files);
    if (file) showOwn(file, "the pasted image");
  });
  document.addEventListener("dragover", (event) => {
    event.preventDefault();
    document.body.classList.add("dropping");
  });
  for (const end of ["dragleave", "drop"]) {
    document.addEventListener(end, () => document.body.classList.remove("dropping"));
  }
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    const file = imageIn(event.dataTransfer.files);
    if (file) showOwn(file, file.name);
    else if (event.dataTransfer.files.length) showFailure(find("#stage"), "The dropped item is not an image.");
  });
  const samples = ["office", "canteen", "lounge"].map((name) => sample(name));
  find("#samples").append(...samples);
}

function sample(name) {
  const path = `assets/${name}.jpg`;
  const pick = async () => {
    // Without its calibration, the sample is an image like others: detection then shows what is wrong.
    await chooseSample(name).catch(leaveSample);
    await show(await (await fetch(path)).blob(), `${name}.jpg`);
  };
  const image = element("img", { src: path, alt: "", width: 56, height: 56 });
  return element("button", { type: "button", class: "sample", onclick: pick }, image, element("span", {}, name));
}
