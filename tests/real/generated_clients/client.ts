/** Calls a server with the generated types: `client.js ADDRESS KEY IMAGE`. Prints the results as JSON. */

import { readFileSync } from "node:fs";
import createClient from "openapi-fetch";
import type { components, paths } from "./schema.js";

const [address, key, image] = process.argv.slice(2);
// Answers are JSON unless a request has another `format`.
type Json = "application/json" | "application/problem+json";
const client = createClient<paths, Json>({
  baseUrl: `http://${address}`,
  headers: { "X-API-Key": key },
});

const profile: components["schemas"]["Profile"] = "fast";
const form = new FormData();
form.set("img", new Blob([readFileSync(image)]));
const frame = { body: { img: "" }, bodySerializer: () => form };

const detected = await client.POST("/detect", {
  params: { query: { calibration: "office", profile } },
  ...frame,
});
if (detected.error) throw new Error(detected.error.detail);
const refused = await client.POST("/detect", {
  params: { query: { calibration: "unknown-id" } },
  ...frame,
});
const rows = await client.GET("/calibrations");
const camera = { params: { path: { camera: "office" } } };
const latest = await client.GET("/results/{camera}/latest", camera);
console.log(
  JSON.stringify({
    persons: detected.data.persons.length,
    score: detected.data.persons[0].score,
    refused: refused.error?.type,
    calibrations: rows.data?.map((row) => row.id),
    latest: latest.data?.persons.length,
  }),
);
