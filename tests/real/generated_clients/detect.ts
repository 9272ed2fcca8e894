/** Sends a frame with the generated client: `detect.js ADDRESS IMAGE`. Prints the number of persons. */

import { readFileSync } from "node:fs";
import { Configuration, DetectionApi, Profile } from "./index";

const [basePath, image] = process.argv.slice(2);
const api = new DetectionApi(new Configuration({ basePath }));
const img = new Blob([readFileSync(image)]);
const options = { calibration: "office", profile: Profile.Fast };
api.detectPersons({ img, ...options }).then((report) => {
  console.log(report.persons.length);
});
