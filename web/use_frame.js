/** The present frame of a camera for the sections that need one. */

import { find } from "./dom.js";
import { options } from "./camera_states.js";
import { show } from "./frame.js";
import { isServing } from "./parameters.js";
import { Problem, ask } from "./server.js";

/** Opens a section with the present frame of a camera and its calibration. */
export async function useFrame({ camera, report, info }, section) {
  const read = readerOf(camera, info);
  const frame = await read();
  const used = report && !report.calibration.assumed ? report.calibration.id : (info?.calibration ?? camera);
  find("#calibration").value = isServing(used) ? used : "";
  await show(frame, `${camera}.jpg`, { camera, read });
  location.hash = section;
}

/** Returns a function that reads the latest image that the server keeps; without one, a frame that the server reads now. */
function readerOf(camera, info) {
  const name = encodeURIComponent(camera);
  let isKept = true;
  const readKept = async (request) => (await ask(`results/${name}/latest.jpg?draw=none`, request)).blob();
  const readNow = async (request) => (await ask(`cameras/${name}/frame.jpg`, request)).blob();
  return async (request) => {
    if (!isKept) return readNow(request);
    try {
      return await readKept(request);
    } catch (problem) {
      if (problem.status !== 404) throw problem;
    }
    const { can_change: may } = await options();
    if (!info || !may) {
      throw new Problem(404, `No image of ${camera} is kept: the setting results.images = ["${camera}"] keeps the latest one.`);
    }
    isKept = false;
    return readNow(request);
  };
}
