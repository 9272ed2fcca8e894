/** The section Detect. */

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { SAMPLES, assertAccessible, detectSample, pageTest, reportAfter } from "./browser.js";

const count = (page) => page.locator("#persons li").count();
const slide = (page, name, value) => page.getByRole("slider", { name }).fill(String(value));

/** Passes a file to the page as the event `kind` does. */
const hand = (page, kind, name, type, bytes) =>
  page.evaluate(
    ([kind, name, type, bytes]) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([new Uint8Array(bytes)], name, { type }));
      const options = { bubbles: true, cancelable: true };
      const event = kind === "drop" ? new DragEvent(kind, { ...options, dataTransfer: transfer }) : new ClipboardEvent(kind, { ...options, clipboardData: transfer });
      document.querySelector("#stage").dispatchEvent(event);
    },
    [kind, name, type, [...bytes]],
  );

pageTest("a sample is picked with the keyboard, and its persons are found", "#detect", async (page) => {
  await page.locator("#calibration option[value=office]").waitFor({ state: "attached" });
  await page.getByRole("button", { name: "office", exact: true }).focus();
  const report = await reportAfter(page, () => page.keyboard.press("Enter"));
  assert.equal(report.persons.length, 6);
  assert.equal(report.calibration.id, "sample-office");
  assert.ok(report.persons.every((person) => person.floor));
  assert.equal(report.camera, "web-page");
  await page.locator("#marks [data-person='5']").waitFor();
  assert.equal(await page.locator("#marks [data-person]").count(), 6);
  assert.equal(await page.locator("#count").textContent(), "6");
  assert.match(await page.locator("#announcement").textContent(), /^6 persons found in \d+ milliseconds\.$/);
  assert.equal(await page.locator("#timings dt").count(), 6);
  assert.match(await page.locator("#frame").getAttribute("alt"), /office\.jpg/);
});

pageTest("an own image has not the calibration of a sample", "#detect", async (page) => {
  await reportAfter(page, () => page.getByRole("button", { name: "office", exact: true }).click());
  const path = `${SAMPLES}/lounge.jpg`;
  const report = await reportAfter(page, () => page.locator("#frame-file").setInputFiles(path));
  assert.equal(report.calibration.assumed, true);
  assert.match(await page.locator("#warnings").textContent(), /no calibration was named/);
});

pageTest("the marks are at the positions of the report", "#detect", async (page) => {
  const report = await reportAfter(page, () => detectSample(page, "office"));
  const [first] = report.persons;
  // Measured at the same moment, as later layout may move them.
  const [image, badge] = await page.evaluate(() =>
    ["#frame", "#marks [data-person='0'] circle"].map((name) => document.querySelector(name).getBoundingClientRect().toJSON()),
  );
  const scale = Math.min(image.width, image.height) / 960;
  const at = (box, side, start) => box[start] + box[side] / 2;
  const fromCenter = (value) => (value - 480) * scale;
  assert.ok(Math.abs(at(badge, "width", "x") - at(image, "width", "x") - fromCenter(first.oriented_box.cx)) < 1);
  assert.ok(Math.abs(at(badge, "height", "y") - at(image, "height", "y") - fromCenter(first.oriented_box.cy)) < 1);
});

pageTest("a frame is dropped, pasted or opened", "#detect", async (page) => {
  const bytes = await readFile(`${SAMPLES}/lounge.jpg`);
  for (const kind of ["drop", "paste"]) {
    const report = await reportAfter(page, () => hand(page, kind, "lounge.jpg", "image/jpeg", bytes));
    assert.ok(report.persons.length > 0);
  }
  const report = await reportAfter(page, () => page.locator("#frame-file").setInputFiles(`${SAMPLES}/canteen.jpg`));
  assert.equal(report.image.width, 960);
  await page.getByAltText("The frame canteen.jpg").waitFor();
});

pageTest("other files are refused with a message, and the next frame is accepted", "#detect", async (page) => {
  await hand(page, "drop", "notes.txt", "text/plain", Buffer.from("hello"));
  await page.getByRole("alert").getByText("The dropped item is not an image.").waitFor();
  await hand(page, "drop", "broken.jpg", "image/jpeg", Buffer.from("hello"));
  await page.getByRole("alert").getByText("broken.jpg is not an image that this browser can read").waitFor();
  await detectSample(page, "office");
  assert.equal(await page.getByRole("alert").count(), 0);
});

pageTest("every parameter runs a new detection at once", "#detect", async (page) => {
  const first = await reportAfter(page, () => detectSample(page, "office", "office"));
  const all = first.persons.length;
  const strict = await reportAfter(page, () => slide(page, "Score threshold", 0.95));
  assert.equal(strict.refinement.score_threshold, 0.95);
  await page.locator("#persons li").nth(all - 1).waitFor({ state: "detached" });
  assert.equal(await count(page), strict.persons.length);
  assert.ok(strict.persons.length < all);
  const overlapping = await reportAfter(page, () => slide(page, "IoU threshold", 0.2));
  assert.equal(overlapping.refinement.iou_threshold, 0.2);
  assert.ok(await page.getByRole("slider", { name: "Softness" }).isDisabled());
  const soft = await reportAfter(page, () => page.locator("#refine").selectOption("soft_nms_gaussian"));
  assert.equal(soft.refinement.name, "soft_nms_gaussian");
  const softer = await reportAfter(page, () => slide(page, "Softness", 0.8));
  assert.equal(softer.refinement.sigma, 0.8);
  const fast = await reportAfter(page, () => page.getByRole("radio", { name: "fast" }).check());
  assert.equal(fast.profile, "fast");
  // Five views, and up to five crops.
  assert.ok(fast.views.inferred >= 5 && fast.views.inferred <= 10);
  const reset = await reportAfter(page, () => page.getByRole("button", { name: "Reset" }).click());
  assert.deepEqual([reset.profile, reset.refinement.name, reset.refinement.score_threshold], ["balanced", "fusion", 0.3]);
});

pageTest("a parameter that was changed just before a frame is opened runs no second detection", "#detect", async (page) => {
  const asked = [];
  page.on("request", (request) => request.url().includes("/detect?") && asked.push(request.url()));
  await page.clock.install();
  await detectSample(page, "office", "office");
  await page.clock.runFor(2000);
  await page.locator("#persons li").first().waitFor();
  assert.equal(asked.length, 1);
});

pageTest("persons in the list and in the image are linked", "#detect", async (page) => {
  await detectSample(page, "office");
  await page.mouse.move(0, 0);
  // A mark may have been under the pointer, which the browser may notice late: each poll focuses anew.
  await page.waitForFunction(() => {
    const row = document.querySelectorAll("#persons button")[2];
    row.blur();
    row.focus();
    const chosen = [...document.querySelectorAll("#marks .chosen")];
    return chosen.length === 1 && chosen[0].dataset.person === "2";
  });
  await page.locator("#persons button").nth(2).blur();
  await page.locator("#marks [data-person='4'] circle").hover();
  await page.locator("#persons button[data-person='4'].chosen").waitFor();
});

pageTest("progress is shown and removed at the end", "#detect", async (page) => {
  let release;
  const released = new Promise((resolve) => (release = resolve));
  await page.route("**/detect?*", async (route) => {
    await released;
    await route.continue();
  });
  await page.getByRole("button", { name: "office", exact: true }).click();
  await page.getByRole("progressbar", { name: "Detecting persons" }).waitFor();
  release();
  await page.locator("#persons li").first().waitFor();
  assert.equal(await page.getByRole("progressbar").count(), 0);
});

pageTest(
  "refusals are shown with the server's message",
  "#detect",
  async (page) => {
    const detail = "all 8 places are taken: come again in 2 s";
    const problem = { status: 429, contentType: "application/problem+json", body: JSON.stringify({ detail }) };
    await page.route("**/detect?*", (route) => route.fulfill(problem));
    await page.getByRole("button", { name: "office", exact: true }).click();
    await page.getByRole("alert").getByText(detail).waitFor();
  },
  { expected: /status of 429/ },
);

pageTest("the report is saved as a file", "#detect", async (page) => {
  await detectSample(page, "office");
  const downloading = page.waitForEvent("download");
  await page.getByRole("button", { name: "Save the report" }).click();
  const report = JSON.parse(await readFile(await (await downloading).path(), "utf8"));
  assert.equal(report.persons.length, 6);
});

pageTest("the previous image leaves no marks", "#detect", async (page) => {
  await detectSample(page, "office");
  await page.route("**/detect?*", () => {});
  await page.getByRole("button", { name: "lounge", exact: true }).click();
  await page.getByAltText("The frame lounge.jpg").waitFor();
  assert.equal(await page.locator("#marks [data-person]").count(), 0);
  assert.equal(await count(page), 0);
  await assertAccessible(page);
});
