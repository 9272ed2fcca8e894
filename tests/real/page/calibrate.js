/** The section Calibrate. */

import assert from "node:assert/strict";
import { assertAccessible, pageTest } from "./browser.js";
import { go, idle, start, stored, straightenedAfter } from "./calibrate_steps.js";

const FIXTURES = process.env.LOOKDOWN_FIXTURES;

const pixels = (page) => page.locator("#previews canvas").first().evaluate((canvas) => canvas.toDataURL());

pageTest("the detected circle is drawn over the frame, and the views follow it", "#detect", async (page) => {
  await start(page);
  for (const name of ["Center, from the left", "Center, from the top", "Radius"]) {
    assert.ok(Math.abs(Number(await page.getByRole("slider", { name }).inputValue()) - 480) < 1.5, name);
  }
  const before = await pixels(page);
  await straightenedAfter(page, () => page.getByRole("slider", { name: "Field of view" }).fill("150"));
  assert.notEqual(await pixels(page), before);
  const handle = await page.locator("[data-handle=rim]").boundingBox();
  const [x, y] = [handle.x + handle.width / 2, handle.y + handle.height / 2];
  await straightenedAfter(page, async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x - 60, y - 60, { steps: 4 });
    await page.mouse.up();
  });
  assert.ok(Number(await page.getByRole("slider", { name: "Radius" }).inputValue()) < 420);
  await straightenedAfter(page, async () => {
    await page.getByRole("slider", { name: "Center, from the left" }).focus();
    await page.keyboard.press("ArrowRight");
  });
  assert.ok(Math.abs(Number(await page.locator("output[for=calibrate-cx]").textContent()) - 480.1) < 1.5);
});

pageTest("a saved lens with a height is used at once and shows the floor", "#detect", async (page) => {
  await start(page);
  await page.getByLabel("Height, meters").fill("2.9");
  await page.getByLabel("Name", { exact: true }).fill("lobby");
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByText("lobby is saved and in use.").waitFor();
  const { lens, mount } = await stored("lobby");
  assert.equal(mount.height_m, 2.9);
  assert.equal(lens.model, "equidistant");
  assert.ok(Math.abs(lens.focal - 305.58) < 0.5 && Math.abs(lens.cx - 479.5) < 0.5, JSON.stringify(lens));
  await go(page, "Detect");
  await page.getByText("m away").first().waitFor();
  assert.equal(await page.locator("#calibration").inputValue(), "lobby");
  await go(page, "Floor");
  await page.locator(".dot-mark").first().waitFor();
  // The second save replaces the first.
  await go(page, "Calibrate");
  await page.getByLabel("Height, meters").fill("3.1");
  await page.getByRole("button", { name: "Replace lobby" }).click();
  await page.getByText("lobby is saved and in use.").waitFor();
  assert.equal((await stored("lobby")).mount.height_m, 3.1);
});

pageTest("a file of another program is previewed and saved unchanged", "#detect", async (page) => {
  await start(page);
  const before = await pixels(page);
  await straightenedAfter(page, () => page.locator("#import-file").setInputFiles(`${FIXTURES}/adapter_ds.yml`));
  await page.getByText("adapter_ds.yml is saved unchanged.").waitFor();
  assert.notEqual(await pixels(page), before);
  await assertAccessible(page);
  await page.getByLabel("Name", { exact: true }).fill("imported");
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByText("imported is saved and in use.").waitFor();
  assert.equal((await stored("imported")).lens.model, "double_sphere");
  await straightenedAfter(page, () => page.getByRole("button", { name: "Back to the circle" }).click());
  assert.equal(await pixels(page), before);
});

pageTest("a camera of a file with several is selected by name", "#detect", async (page) => {
  await start(page);
  await page.locator("#import-file").setInputFiles(`${FIXTURES}/kalibr_camchain.yaml`);
  await page.getByRole("alert").getByText("cam0, cam1").waitFor();
  const answer = await straightenedAfter(page, () => page.getByLabel("Camera, if the file has several").fill("cam1"));
  assert.equal(answer.status(), 200);
  assert.equal(await page.getByRole("alert").count(), 0);
}, { expected: /status of 422/ });

pageTest("a file without a frame size is read with the size of this frame", "#detect", async (page) => {
  await start(page);
  await page.locator("#import-file").setInputFiles(`${FIXTURES}/py_ocamcalib.json`);
  const saying = page.getByRole("alert");
  await page.waitForResponse((answer) => answer.url().includes("size=960x960"));
  await idle(page);
  assert.equal(await saying.count(), 0, (await saying.allTextContents()).join());
}, { expected: /status of 422/ });

pageTest("a calibration in use is opened and edited", "#detect", async (page) => {
  await start(page, "office");
  const answer = await straightenedAfter(page, () => page.locator("#open-calibration").selectOption("canteen"));
  assert.equal(answer.status(), 200);
  assert.equal(await page.getByLabel("Height, meters").inputValue(), "2.9");
  assert.equal(await page.getByLabel("Name", { exact: true }).inputValue(), "canteen");
  await page.getByRole("button", { name: "Replace canteen" }).waitFor();
});

pageTest(
  "an invalid calibration file is refused with the server's message",
  "#detect",
  async (page) => {
    await start(page);
    const file = { name: "notes.txt", mimeType: "text/plain", buffer: Buffer.from("hello") };
    const answer = await straightenedAfter(page, () => page.locator("#import-file").setInputFiles(file));
    const { detail } = await answer.json();
    await page.getByRole("alert").getByText(detail).waitFor();
  },
  { expected: /status of 4\d\d/ },
);
