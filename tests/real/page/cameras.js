/** The section Cameras of `lookdown run`: a camera is added, tested, used in the other sections, changed and removed. */

import assert from "node:assert/strict";
import { PHONE, WIDE, assertAccessible, assertFits, pageTest, screenshot } from "./browser.js";

/** The addresses of `lookdown run` without cameras, of one with a camera of its settings, and of a camera with the user `viewer`. */
const { LOOKDOWN_RUN_URL: RUN, LOOKDOWN_SETTINGS_RUN_URL: SETTINGS_RUN, LOOKDOWN_CAMERA_URL: CAMERA, LOOKDOWN_CAMERA_PASSWORD: PASSWORD } = process.env;
const useFrame = (page, name) => page.getByRole("group", { name: `Use this frame of ${name}` });
const suggestionOf = (page, name) => page.getByRole("group", { name: `Suggested calibration of ${name}` });
const add = (name, path) => fetch(`${RUN}/cameras/${name}`, { method: "PUT", body: JSON.stringify({ url: `${CAMERA}${path}`, user: "viewer", password: PASSWORD }) });
/** Longer than the interval of questions for the states of cameras. */
const STATES_MILLIS = 4000;
const camera = async (name) => (await fetch(`${RUN}/cameras/${name}`)).json();

pageTest(
  "a camera is added, tested, used and removed in the page",
  "",
  async (page) => {
    await page.getByText("No camera yet: add the first one.").waitFor();
    await assertAccessible(page);
    await page.locator("#first-camera").click();
    const dialog = page.getByRole("dialog", { name: "Add a camera" });
    await dialog.getByText("URLs of common makers").click();
    await dialog.getByRole("button", { name: /Streaming\/Channels/ }).click();
    assert.equal(await dialog.getByLabel("URL").inputValue(), "rtsp://HOST:554/Streaming/Channels/102");
    await dialog.getByLabel("URL").fill(`${CAMERA}/snapshot.jpg?token=1`);
    await dialog.locator("#camera-name").fill("Hall");
    await dialog.getByText("it is deleted after 24 hours").waitFor();
    await dialog.getByRole("button", { name: "Test" }).click();
    await dialog.getByText("the camera requires a user name and a password").waitFor();
    await dialog.getByLabel("User").fill("viewer");
    await dialog.getByLabel("Password").fill(PASSWORD);
    await dialog.getByRole("button", { name: "Test" }).click();
    await dialog.getByText("It works: 960 × 960 pixels.").waitFor();
    await assertAccessible(page);
    await dialog.getByRole("button", { name: "Save" }).click();
    await page.getByRole("heading", { name: "hall", level: 1 }).waitFor();
    assert.match(page.url(), /#camera\/hall$/);
    const card = page.getByRole("article", { name: "Camera hall" });
    await card.locator(".plot.hours").waitFor();
    const image = card.getByAltText("The latest frame of hall");
    await image.waitFor();
    const keep = card.getByLabel("Keep the latest image");
    await keep.uncheck();
    await card.locator(".sketch").waitFor();
    await card.getByText("it is deleted after 24 hours").waitFor();
    assert.equal((await camera("hall")).keep_image, false);
    await keep.check();
    await image.waitFor();
    const views = card.getByRole("group", { name: "Views of hall" });
    await views.getByRole("button", { name: "Panorama" }).click();
    const straight = card.getByAltText("A straight view of hall");
    await page.waitForFunction((node) => node.naturalWidth === 1600, await straight.elementHandle());
    page.once("dialog", (question) => question.accept("ring"));
    await views.getByRole("button", { name: "Keep this view" }).click();
    await views.getByText("The view ring is kept.").waitFor();
    assert.equal((await fetch(`${RUN}/cameras/hall/views/ring`)).status, 200);
    await views.getByRole("button", { name: "Disc" }).click();
    await image.waitFor();
    await assertFits(page);
    await assertAccessible(page);
    // The frame is read from the camera, because no image of it is kept.
    await useFrame(page, "hall").getByRole("button", { name: "Calibrate" }).click();
    await page.locator("#previews canvas").first().waitFor();
    assert.equal(await page.locator("#calibrate-id").inputValue(), "hall");
    await page.getByRole("button", { name: "Save", exact: true }).click();
    await page.getByText("hall is saved and in use.").waitFor();
    // The running camera uses the calibration of its name at once.
    const used = async () => (await (await fetch(`${RUN}/results/hall/latest`)).json()).calibration.id;
    for (let attempt = 0; attempt < 100 && (await used()) !== "hall"; attempt += 1) await page.waitForTimeout(100);
    assert.equal(await used(), "hall");
    await page.getByRole("navigation").getByRole("link", { name: "Cameras" }).click();
    await card.getByRole("button", { name: "Pause" }).click();
    await card.getByText("Paused: no frames are read.").waitFor();
    await card.getByRole("button", { name: "Settings" }).click();
    const settings = page.getByRole("dialog", { name: "Settings of hall" });
    assert.equal(await settings.getByLabel("Password").inputValue(), "");
    await settings.getByLabel("Rate").selectOption("200ms");
    // The stored URL with its query, and the password, stay.
    await settings.getByRole("button", { name: "Test" }).click();
    await settings.getByText("It works: 960 × 960 pixels.").waitFor();
    await settings.getByRole("button", { name: "Save" }).click();
    await page.getByRole("heading", { name: "hall", level: 1 }).waitFor();
    const { every, paused } = await camera("hall");
    assert.deepEqual([every, paused], ["200ms", true]);
    await card.getByRole("button", { name: "Resume" }).click();
    await card.getByRole("button", { name: "Pause" }).waitFor();
    page.on("dialog", (question) => question.accept());
    await card.getByRole("button", { name: "Delete its history" }).click();
    await card.getByRole("button", { name: "Remove" }).click();
    await card.waitFor({ state: "detached" });
    for (const address of ["cameras/hall", "results/hall/latest"]) assert.equal((await fetch(`${RUN}/${address}`)).status, 404);
  },
  { server: RUN, expected: /status of 4(04|22)/ },
);

pageTest(
  "five answers within a minute teach the number of a camera",
  "#camera/desk",
  async (page) => {
    const body = { url: `${CAMERA}/snapshot.jpg?token=1`, user: "viewer", password: PASSWORD, keep_image: true };
    await fetch(`${RUN}/cameras/desk`, { method: "PUT", body: JSON.stringify(body) });
    const card = page.getByRole("article", { name: "Camera desk" });
    await card.locator(".error-bar").waitFor({ timeout: 60_000 });
    const began = Date.now();
    await card.getByRole("button", { name: "How many are there now?" }).click({ timeout: 30_000 });
    const number = card.getByLabel("People in this frame");
    await card.getByAltText("The frame of desk to count people in").waitFor();
    const found = Number(await number.textContent());
    await card.getByRole("button", { name: "One fewer" }).click();
    assert.equal(Number(await number.textContent()), Math.max(0, found - 1));
    await assertAccessible(page);
    await screenshot(page, "reference-counts");
    for (let answers = 1; answers <= 5; answers += 1) {
      while (Number(await number.textContent()) < 6) await card.getByRole("button", { name: "One more" }).click();
      await card.getByRole("button", { name: "Right" }).click();
      await card.getByText(answers < 5 ? `${answers} answer${answers > 1 ? "s" : ""}` : "The number has learned from 5 answers", { exact: answers < 5 }).waitFor();
      if (answers < 5) await number.waitFor();
    }
    assert.ok(Date.now() - began < 60_000, `${Date.now() - began} ms`);
    for (let attempt = 0; attempt < 100; attempt += 1) {
      const row = (await (await fetch(`${RUN}/results`)).json()).find(({ camera: name }) => name === "desk");
      if (row.persons_source === "taught" && row.persons === 6) break;
      await page.waitForTimeout(100);
    }
    await card.locator(".big").filter({ hasText: /^6 ± \d/ }).waitFor();
    await card.getByText("5 answers", { exact: true }).click();
    await card.getByRole("button", { name: /^Delete: 6 persons/ }).first().click();
    await card.getByText(/^1 more answer and the number learns from you/).waitFor();
    await fetch(`${RUN}/cameras/desk`, { method: "DELETE" });
    assert.equal((await fetch(`${RUN}/cameras/desk/reference-counts`)).status, 404);
  },
  { server: RUN, expected: /status of 404/ },
);

pageTest(
  "a calibration that was found in a running camera is looked at and applied",
  "",
  async (page) => {
    await add("yard", "/room.png");
    const suggestion = suggestionOf(page, "yard");
    await suggestion.getByText(/A calibration was found in \d of 5 frames: 18\d° field of view, tilted by \d\.\d°/).waitFor({ timeout: 180_000 });
    await assertAccessible(page);
    await suggestion.getByRole("button", { name: "Look" }).click();
    await page.locator("#calibration-values").getByText(/of \d+ follow the room/).waitFor();
    const after = page.locator("#previews .after").first();
    await after.waitFor();
    await page.getByRole("slider", { name: /Before/ }).fill("20");
    assert.match(await after.evaluate((canvas) => getComputedStyle(canvas).clipPath), /20%/);
    assert.equal(await page.locator("#calibrate-id").inputValue(), "yard");
    assert.equal((await fetch(`${RUN}/calibrations/yard`)).status, 404);
    await page.getByRole("navigation").getByRole("link", { name: "Cameras" }).click();
    await suggestion.getByRole("button", { name: "Apply" }).click();
    await page.waitForFunction(async (url) => (await fetch(url)).ok, `${RUN}/calibrations/yard`);
    await suggestion.getByText("field of view").waitFor({ state: "detached" });
    await fetch(`${RUN}/cameras/yard`, { method: "DELETE" });
  },
  { server: RUN, expected: /status of 404/ },
);

pageTest(
  "a refused suggestion says why, and leads to Calibrate",
  "",
  async (page) => {
    const asked = [];
    page.on("request", (request) => request.url().includes("/suggested-calibration") && asked.push(request.url()));
    await add("lab", "/snapshot.jpg?token=1");
    const suggestion = suggestionOf(page, "lab");
    await suggestion.getByText("No calibration was found. Calibrate compares the usual lenses").waitFor({ timeout: 180_000 });
    for (const viewport of [{ width: 1280, height: 800 }, PHONE]) {
      await page.setViewportSize(viewport);
      await assertFits(page);
      await assertAccessible(page);
    }
    await suggestion.getByRole("button", { name: "Calibrate" }).click();
    await page.locator("#previews canvas").first().waitFor();
    assert.equal(await page.locator("#calibrate-id").inputValue(), "lab");
    await page.getByLabel("Known lens").selectOption("equidistant");
    await page.getByRole("button", { name: "Find the lens" }).click();
    await page.locator("#calibration-values").getByText(/of \d+ follow the room/).waitFor();
    await page.locator("#calibrate-height").fill("2.9");
    await page.getByRole("button", { name: "Save", exact: true }).click();
    await page.getByText("lab is saved and in use.").waitFor();
    await page.getByRole("navigation").getByRole("link", { name: "Cameras" }).click();
    await suggestion.getByText("No calibration").waitFor({ state: "detached" });
    // A camera with a calibration has no question.
    await page.reload();
    await page.getByRole("article", { name: "Camera lab" }).locator(".plot").first().waitFor();
    const before = asked.length;
    await page.waitForTimeout(STATES_MILLIS);
    assert.equal(asked.length, before);
    for (const address of ["cameras/lab", "calibrations/lab"]) await fetch(`${RUN}/${address}`, { method: "DELETE" });
  },
  { server: RUN, expected: /status of 4(04|22)/ },
);

pageTest(
  "a camera of the settings is paused and resumed in the page",
  "#camera/gate",
  async (page) => {
    const card = page.getByRole("article", { name: "Camera gate" });
    await card.getByRole("button", { name: "Pause" }).click();
    await card.getByText("Paused: no frames are read.").waitFor();
    for (const name of ["Settings", "Remove"]) assert.equal(await card.getByRole("button", { name }).count(), 0);
    await card.getByRole("button", { name: "Resume" }).click();
    await card.getByRole("button", { name: "Pause" }).waitFor();
  },
  { server: SETTINGS_RUN, expected: /status of 404/ },
);

for (const [device, viewport, colorScheme] of [["wide", WIDE, "dark"], ["phone", PHONE, "light"]]) {
  pageTest(
    `the address of a camera and the form are well on a ${device} screen`,
    "#camera/hall",
    async (page) => {
      await add("hall", "/snapshot.jpg?token=1");
      await page.getByRole("heading", { name: "hall", level: 1 }).waitFor();
      await page.locator(".card .plot").first().waitFor();
      await assertFits(page);
      await assertAccessible(page);
      await screenshot(page, `camera-${device}`);
      await page.getByRole("button", { name: "Add a camera" }).click();
      await page.getByText("URLs of common makers").click();
      await assertFits(page);
      await assertAccessible(page);
      await screenshot(page, `add-camera-${device}`);
    },
    { server: RUN, viewport, colorScheme, expected: /status of 404/ },
  );
}
