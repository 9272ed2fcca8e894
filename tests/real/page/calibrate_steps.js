/** Steps of the tests of the section Calibrate. */

import assert from "node:assert/strict";
import { SERVER, detectSample } from "./browser.js";

export const go = (page, name) => page.getByRole("navigation").getByRole("link", { name }).click();
export const stored = async (id) => (await fetch(`${SERVER}/calibrations/${id}`)).json();

/** Opens Calibrate with the sample `office`. */
export async function start(page, lens = "") {
  await detectSample(page, "office", lens);
  await go(page, "Calibrate");
  await page.locator("#previews canvas").nth(3).waitFor();
}

export const idle = (page) => page.locator("#previews-progress:not([aria-busy])").waitFor({ state: "attached" });

/** Waits until the views are straightened again after `act`. */
export async function straightenedAfter(page, act) {
  await idle(page);
  const answered = page.waitForResponse((answer) => answer.url().includes("/views?profile=fast"));
  await act();
  const answer = await answered;
  await idle(page);
  return answer;
}

export const nameField = (page) => page.getByLabel("Name", { exact: true }).first();
export const heightField = (page) => page.getByLabel("Height, meters");
export const findButton = (page) => page.getByRole("button", { name: "Find the lens" });

/** Saves under a name, or replaces the calibration of this name. */
export async function saveAs(page, id) {
  await nameField(page).fill(id);
  await page.locator("#save").click();
  await page.getByText(`${id} is saved and in use.`).waitFor();
}

/** The rows of the table of values: `title | text | source`. */
export const values = (page) =>
  page.locator("#calibration-values > div").evaluateAll((rows) => rows.map((row) => [...row.children].map((cell) => cell.textContent).join(" | ")));

/** Stores a copy of the calibration `office` with these fields. */
export async function storeCopy(id, fields) {
  const answer = await fetch(`${SERVER}/calibrations/${id}`, { method: "PUT", body: JSON.stringify({ ...(await stored("office")), id, ...fields }) });
  assert.ok(answer.ok, await answer.text());
}
