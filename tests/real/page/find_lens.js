/** "Find the lens" of the section Calibrate: known values, frames of a live camera, refusals, and the table of values. */

import assert from "node:assert/strict";
import { PHONE, assertAccessible, assertFits, pageTest, post } from "./browser.js";
import { findButton, heightField, nameField, saveAs, start, storeCopy, stored, straightenedAfter, values } from "./calibrate_steps.js";

const GIVEN = { source: "given" };
const MEASURED = { source: "measured", uncertainty: 0.4 };

/** Finds the lens of the sample `office` with its true model. */
async function findEquidistant(page) {
  await page.getByLabel("Known lens").selectOption("equidistant");
  await straightenedAfter(page, () => findButton(page).click());
}

for (const [device, options] of [["wide", {}], ["phone", { viewport: PHONE, hasTouch: true }]]) {
  pageTest(
    `without the model, both lenses are shown side by side on a ${device} screen`,
    "#detect",
    async (page) => {
      await start(page);
      await findButton(page).click();
      // Three fits, one after the other.
      await page.getByText("This frame cannot tell which").waitFor({ timeout: 180_000 });
      assert.deepEqual(await page.locator("#lens-choice h3").allTextContents(), ["equidistant", "equisolid"]);
      assert.equal(await page.locator("#lens-choice canvas").count(), 4);
      await assertFits(page);
      await assertAccessible(page);
      await straightenedAfter(page, () => page.getByRole("button", { name: "Use equidistant" }).click());
      assert.equal(await page.getByLabel("Known lens").inputValue(), "");
      assert.equal(await page.locator("#find-progress").textContent(), "");
      assert.equal(await page.locator("#circle .rim").first().isVisible(), true);
      assert.equal(await page.locator("#circle .handle").count(), 0);
      const rows = (await values(page)).join("\n");
      for (const row of [/^Lens \| equidistant \| assumed/m, /^Radius \| ± [5-9]\.\d\d %/m, /^Field of view \| 1(79|80)\.\d°/m, /^Center \| 4\d\d\.\d, 4\d\d\.\d ± \d\.\d px \| measured$/m, /^Tilt \| \d\.\d° ± \d\.\d\d° \| measured$/m]) assert.match(rows, row);
      await assertFits(page);
      await assertAccessible(page);
    },
    { ...options, expected: /status of 422 .*\/fit\?$/ },
  );
}

pageTest("a height is typed after the lens was found, and saved as given", "#detect", async (page) => {
  await start(page);
  await findEquidistant(page);
  await heightField(page).fill("2.75");
  await saveAs(page, "level");
  const level = await stored("level");
  assert.equal(level.lens.model, "equidistant");
  assert.deepEqual([level.mount.height_m, level.sources.height_m], [2.75, GIVEN]);
  assert.equal(level.sources.world_up.source, "measured");
  // The second save replaces the first, with the lens unchanged.
  await heightField(page).fill("2.8");
  await saveAs(page, "level");
  const again = await stored("level");
  assert.deepEqual([again.mount.height_m, again.lens, again.sources.lens], [2.8, level.lens, level.sources.lens]);
  await page.getByRole("button", { name: "Back to the circle" }).click();
  assert.equal(await heightField(page).inputValue(), "2.8");
});

pageTest("a known field of view is sent, and one out of range is refused in the form", "#detect", async (page) => {
  await start(page);
  const asked = [];
  page.on("request", (request) => request.url().includes("/fit?") && asked.push(new URL(request.url()).search));
  const known = page.getByLabel("Known field of view");
  await known.fill("400");
  await findButton(page).click();
  assert.equal(await known.evaluate((input) => input.validity.rangeOverflow), true);
  await known.fill("180");
  await findEquidistant(page);
  assert.deepEqual(asked, ["?lens=equidistant&field_of_view_deg=180"]);
  const rows = (await values(page)).join("\n");
  assert.match(rows, /^Lens \| equidistant \| given\nField of view \| 180.0° \| given$/m);
  assert.doesNotMatch(rows, /undefined|NaN/);
});

pageTest("a found lens names what it replaces, and the known height stays", "#detect", async (page) => {
  await storeCopy("replaced", { mount: { world_up: [0, 0, -1], height_m: 3 }, sources: { lens: GIVEN, center: MEASURED, world_up: { source: "assumed" }, height_m: GIVEN } });
  await page.reload();
  await start(page);
  await nameField(page).fill("replaced");
  await findEquidistant(page);
  assert.deepEqual(await page.locator("#replaced-values li").allTextContents(), ["Replaces the given lens.", "Replaces the measured center."]);
  assert.ok((await values(page)).includes("Height | 3.00 m | given"), (await values(page)).join("\n"));
  await assertAccessible(page);
  // Under another name, it replaces nothing.
  await nameField(page).fill("replaced-too");
  assert.ok(await page.locator("#replaced-values").isHidden());
  await saveAs(page, "replaced");
  assert.ok(await page.locator("#replaced-values").isHidden());
  const { mount, sources } = await stored("replaced");
  assert.deepEqual([mount.height_m, sources.height_m, sources.center.source], [3, GIVEN, "measured"]);
});

pageTest("an opened calibration shows its values and sources, which edits change", "#detect", async (page) => {
  const sources = { lens: MEASURED, lens_model: GIVEN, center: MEASURED, world_up: { source: "assumed" }, height_m: { source: "from_people", uncertainty: 0.2 } };
  await page.route("**/calibrations/sourced", async (route) => {
    const answer = await route.fetch();
    await route.fulfill({ response: answer, json: { ...(await answer.json()), sources } });
  });
  await storeCopy("sourced", {});
  await page.reload();
  await start(page);
  await straightenedAfter(page, () => page.locator("#open-calibration").selectOption("sourced"));
  const ofLens = ["Lens | equidistant | given", "Field of view | 180.0° | measured", "Radius | ± 0.40 % | measured", "Center | 480.0, 480.0 ± 0.4 px | measured", "Tilt | 0.0° | assumed"];
  assert.deepEqual(await values(page), [...ofLens, "Height | 2.90 m ± 0.20 m | from people"]);
  await heightField(page).fill("3.1");
  assert.deepEqual(await values(page), [...ofLens, "Height | 3.10 m | given"]);
  await straightenedAfter(page, () => page.getByRole("slider", { name: "Radius" }).fill("400"));
  assert.deepEqual(await values(page), ["Lens | equidistant | given", "Field of view | 180.0° | given", "Center | 480.0, 480.0 | given", "Tilt | 0.0° | assumed", "Height | 3.10 m | given"]);
});

pageTest("the height of an opened calibration without a circle is changed", "#detect", async (page) => {
  const mount = { world_up: [0, Math.sin(0.1), -Math.cos(0.1)], height_m: 2.9 };
  const sources = { lens: MEASURED, world_up: MEASURED, height_m: MEASURED };
  await storeCopy("tilted", { mount, sources });
  await page.reload();
  await start(page);
  await straightenedAfter(page, () => page.locator("#open-calibration").selectOption("tilted"));
  await page.getByText("tilted keeps its lens.").waitFor();
  assert.ok((await values(page)).includes("Tilt | 5.7° ± 0.40° | measured"));
  assert.equal(await heightField(page).inputValue(), "2.9");
  await heightField(page).fill("3.2");
  await saveAs(page, "tilted");
  const after = await stored("tilted");
  assert.deepEqual([after.mount.height_m, after.sources], [3.2, { ...sources, height_m: GIVEN }]);
});

/** Records the numbers of images in the requests for a fit, which are refused. */
async function recordFits(page) {
  await page.addInitScript(() => {
    const send = window.fetch;
    window.imagesSent = [];
    window.fetch = (path, options) => {
      if (!String(path).includes("/fit?")) return send(path, options);
      const { body } = options;
      window.imagesSent.push(body instanceof FormData ? body.getAll("img").length : 1);
      const detail = "halves of the edges disagree: give further frames";
      return Promise.resolve(new Response(JSON.stringify({ detail }), { status: 422, headers: { "Content-Type": "application/problem+json" } }));
    };
  });
  await page.reload();
}

/** Opens the frame of a camera in Calibrate and searches for its lens until that is refused. */
async function searchInFrameOf(page, camera) {
  await page.getByRole("navigation").getByRole("link", { name: "Cameras" }).click();
  await page.getByRole("group", { name: `Use this frame of ${camera}` }).getByRole("button", { name: "Calibrate" }).click();
  await page.locator("#previews canvas").first().waitFor();
  await findButton(page).click();
}

pageTest("further frames of a live camera are sent, and one frame of a silent one", "#cameras", async (page) => {
  await recordFits(page);
  await post("gate", "office");
  await post("lounge", "lounge");
  const refusal = page.getByRole("alert").getByText("halves of the edges disagree");
  await searchInFrameOf(page, "lounge");
  await page.getByText("Frame 2 of 4").waitFor();
  await post("lounge", "canteen");
  await page.getByText("Frame 3 of 4").waitFor();
  await post("lounge", "office");
  // The same image again is not a further frame.
  await page.getByText("Frame 4 of 4").waitFor();
  await refusal.waitFor();
  await searchInFrameOf(page, "gate");
  await refusal.waitFor();
  assert.deepEqual(await page.evaluate(() => window.imagesSent), [3, 1]);
});
