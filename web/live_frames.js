/** Further frames of a live camera: several frames determine its lens better than one. */

import { askJson } from "./server.js";

/** The number of frames, the first one included. */
const FRAMES = 4;
const INTERVAL_MILLIS = 2000;
/** The longest wait for all of them. */
const WAIT_MILLIS = 10_000;
/** The age of the latest report up to which a camera is live. */
const LIVE_SECONDS = 10;

const pause = (millis) => new Promise((resolve) => setTimeout(resolve, millis));

/** The images of a frame and of up to three later ones of its camera, until `signal` aborts; `say` gets the progress. */
export async function imagesOf(frame, say, signal) {
  const images = [frame.blob];
  if (!(await isLive(frame))) return images;
  const ends = performance.now() + WAIT_MILLIS;
  while (images.length < FRAMES && performance.now() + INTERVAL_MILLIS <= ends) {
    say(`Frame ${images.length + 1} of ${FRAMES}`);
    await pause(INTERVAL_MILLIS);
    const timeout = AbortSignal.timeout(Math.max(1, ends - performance.now()));
    const image = await frame.read({ signal: AbortSignal.any([signal, timeout]) }).catch(() => null);
    signal.throwIfAborted();
    if (image && !(await isAmong(images, image))) images.push(image);
  }
  return images;
}

/** True if frames of the camera of `frame` arrive now. */
async function isLive({ camera, read }) {
  if (!read) return false;
  const rows = await askJson("results").catch(() => []);
  return rows.some((row) => row.camera === camera && row.age_seconds < LIVE_SECONDS);
}

async function isAmong(images, image) {
  const bytes = new Uint8Array(await image.arrayBuffer());
  for (const other of images) {
    if (other.size !== image.size) continue;
    const theirs = new Uint8Array(await other.arrayBuffer());
    if (theirs.every((byte, index) => byte === bytes[index])) return true;
  }
  return false;
}
