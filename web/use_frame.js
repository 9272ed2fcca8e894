/** The present frame of a camera for the sections that need one. */

import { find } from "./dom.js";
import { options } from "./camera_states.js";
import { show } from "./frame.js";
import { isServing } from "./parameters.js";
import { Problem, ask } from "./server.js";

/** Opens a section with the present frame of a camera and its calibration. */
export async function useFrame({ camera, report, info }, section) {
  const frame = await frameOf(camera, info);
  const used = report && !report.calibration.assumed ? report.calibration.id : (info?.calibration ?? camera);
  find("#calibration").value = isServing(used) ? used : "";
  await show(frame, `${camera}.jpg`, camera);
  location.hash = section;
}

/** The latest image that the server keeps; without one, a frame that the server reads now. */
async function frameOf(camera, info) {
  const name = encodeURIComponent(camera);
  try {
    return await (await ask(`results/${name}/latest.jpg?draw=none`)).blob();
  } catch (problem) {
    if (problem.status !== 404) throw problem;
  }
  const { can_change: may } = await options();
  if (!info || !may) {
    throw new Problem(404, `No image of ${camera} is kept: the setting results.images = ["${camera}"] keeps the latest one.`);
  }
  return (await ask(`cameras/${name}/frame.jpg`)).blob();
}
