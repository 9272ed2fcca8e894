/** Prints the persons of a frame: `detect.js FRAME [SERVER]`. docs/python-client.md has types for all answers. */

import { readFileSync } from "node:fs";

const [frame, server = "http://localhost:8080"] = process.argv.slice(2);
const form = new FormData();
form.set("img", new Blob([readFileSync(frame)]));
const answer = await fetch(`${server}/detect?score_threshold=0.3`, { method: "POST", body: form });
const report = await answer.json();
if (!answer.ok) throw new Error(report.detail);
for (const { score, box } of report.persons) console.log(score.toFixed(2), JSON.stringify(box));
