/** The sections Views, Floor and Cameras, and the key. */

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { SAMPLES, SERVER, assertAccessible, detectSample, pageTest, post, reportAfter } from "./browser.js";

const go = (page, name) => page.getByRole("navigation").getByRole("link", { name }).click();

pageTest("an address selects its section, and a section without a frame shows a hint", "#views", async (page) => {
  await page.getByRole("heading", { name: "Views", level: 1 }).waitFor();
  await page.getByText("or pick one in Detect: its views are shown here").waitFor();
  assert.equal(await page.title(), "Views – Lookdown");
  await go(page, "Floor");
  await page.getByText("its persons are shown here from above").waitFor();
  await go(page, "Calibrate");
  await page.locator("#calibrate-empty").getByText("or pick one in Detect").waitFor();
  assert.match(page.url(), /#calibrate$/);
  await go(page, "Zones");
  await page.getByText("or pick one in Detect: zones are drawn on it").waitFor();
  await page.goBack();
  await page.goBack();
  await page.getByRole("heading", { name: "Floor", level: 1 }).waitFor();
});

for (const [lens, what] of [["", "a lens that was assumed"], ["office", "a calibration"]]) {
  pageTest(`the views of ${what} are straightened and highlighted for a selected person`, "#detect", async (page) => {
    await detectSample(page, "office", lens);
    await go(page, "Views");
    const tiles = page.getByRole("group", { name: "Views", exact: true }).getByRole("button");
    await tiles.nth(15).waitFor();
    assert.equal(await page.locator("#outlines polygon").count(), 16);
    await page.getByText("16 views of the profile balanced see 100 % of the lens image").waitFor();
    // The person by the paintings is in some views. The others are dimmed.
    await page.getByRole("button", { name: "2", exact: true }).click();
    await page.locator(".tile.dim").first().waitFor();
    const seeing = await page.locator(".tile:not(.dim)").count();
    assert.ok(seeing >= 2 && seeing <= 12, `${seeing}`);
    assert.equal(await page.locator("#outlines .sees").count(), seeing);
    await tiles.nth(2).click();
    await page.locator("#outlines polygon.chosen").waitFor();
    assert.equal(await tiles.nth(2).getAttribute("aria-pressed"), "true");
    assert.ok((await colors(page, ".tile canvas")) > 200);
  });
}

/** The number of colors of a canvas, which shows if anything is drawn. */
const colors = (page, selector) =>
  page.locator(selector).first().evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return new Set(new Uint32Array(data.buffer)).size;
  });

pageTest("a profile without views shows a hint, and the paper's shows all of its views", "#detect", async (page) => {
  await detectSample(page, "office", "office");
  await reportAfter(page, () => page.getByRole("radio", { name: "direct" }).check());
  await go(page, "Views");
  await page.getByText("there are no views").waitFor();
  await go(page, "Detect");
  await reportAfter(page, () => page.getByRole("radio", { name: "paper" }).check());
  await go(page, "Views");
  await page.locator(".tile").nth(127).waitFor();
});

pageTest("the floor map shows the positions of the report, if the height is known", "#detect", async (page) => {
  const report = await reportAfter(page, () => detectSample(page, "office", "office"));
  await go(page, "Floor");
  await page.locator(".dot-mark").first().waitFor();
  assert.equal(await page.locator(".dot-mark").count(), report.persons.length);
  const cells = await page.locator("#places tr").first().locator("td").allTextContents();
  const { x_m: x, y_m: y } = report.persons[0].floor;
  assert.deepEqual(cells.slice(0, 2), [x, y].map((value) => `${value.toFixed(2).replace("-", "−")} m`));
  await page.getByText("2.9 m above the floor").waitFor();
  const [camera, dot] = await Promise.all(["#map .camera", ".dot-mark[data-person='0'] circle"].map((at) => page.locator(at).boundingBox()));
  assert.equal(Math.sign(dot.x - camera.x), Math.sign(x));
  assert.equal(Math.sign(dot.y - camera.y), Math.sign(y));
  await go(page, "Detect");
  await reportAfter(page, () => page.locator("#calibration").selectOption(""));
  await go(page, "Floor");
  await page.getByText("The height of this camera above the floor is not known").waitFor();
});

pageTest("a new camera appears in Cameras, and its card is updated", "#cameras", async (page) => {
  await page.locator("#section-cameras").waitFor();
  const first = await post("hall 1", "office");
  const card = page.getByRole("article", { name: "Camera hall 1" });
  await card.waitFor();
  await card.getByText(String(first.persons.length), { exact: true }).first().waitFor();
  assert.equal(await card.locator(".sketch polygon").count(), first.persons.length);
  const plot = card.getByRole("img", { name: "Persons over time" });
  const second = await post("hall 1", "canteen", "profile=fast&max_detections=2");
  assert.notEqual(second.persons.length, first.persons.length);
  await card.locator(".big b").getByText(String(second.persons.length), { exact: true }).waitFor();
  const most = Math.max(first.persons.length, second.persons.length);
  assert.match(await plot.getAttribute("aria-label"), new RegExp(`${second.persons.length} persons? now, at most ${most} since`));
});

pageTest("a camera with kept images is shown with them", "#cameras", async (page) => {
  await post("gate", "office");
  await page.getByRole("article", { name: "Camera gate" }).getByAltText("The latest frame of gate").waitFor();
});

pageTest("the skip link leads to the content, and Tab passes over boxes", "#cameras", async (page) => {
  await post("gate", "office");
  const card = page.getByRole("article", { name: "Camera gate" });
  await card.locator("[data-box]").first().waitFor();
  await page.keyboard.press("Tab");
  await page.getByRole("link", { name: "Skip to the content" }).press("Enter");
  assert.equal(await page.evaluate(() => document.activeElement.id), "main");
  assert.match(page.url(), /#cameras$/);
  assert.equal(await card.locator("[data-box][tabindex]").count(), 0);
});

pageTest("a later visitor sees earlier results", "#detect", async (page) => {
  await post("yard", "office");
  await post("yard", "lounge", "profile=fast&max_detections=1");
  await go(page, "Cameras");
  const card = page.getByRole("article", { name: "Camera yard" });
  await card.waitFor();
  assert.match(await card.locator(".plot .steps").getAttribute("d"), /V/);
});

pageTest("a click on a false box ignores its place, and Undo takes it back", "#cameras", async (page) => {
  const address = (id) => `${SERVER}/calibrations/${id}`;
  const stored = async (id) => (await fetch(address(id))).json();
  const copy = JSON.stringify({ ...(await stored("office")), id: "stall" });
  assert.ok((await fetch(address("stall"), { method: "PUT", body: copy })).ok);
  const body = await readFile(`${SAMPLES}/office.jpg`);
  const send = async (camera) => {
    const answer = await fetch(`${SERVER}/detect?profile=fast&calibration=stall&camera=${camera}`, { method: "POST", body });
    return answer.json();
  };
  const before = await send("stall");
  const card = page.getByRole("article", { name: "Camera stall", exact: true });
  await card.locator("[data-box='0']").dispatchEvent("pointerdown");
  await card.getByText("The place is ignored from the next frame on.").waitFor();
  assert.equal((await stored("stall")).ignore.length, 1);
  assert.ok((await send("stall")).persons.length < before.persons.length);
  await assertAccessible(page);
  await card.getByRole("button", { name: "Undo" }).click();
  await card.getByText("The place counts again.").waitFor();
  assert.equal((await stored("stall")).ignore, undefined);
  assert.equal((await send("stall")).persons.length, before.persons.length);
  // A calibration that two cameras use becomes one of the camera's own.
  await send("stall-2");
  const second = page.getByRole("article", { name: "Camera stall-2" });
  await second.locator("[data-box='0']").dispatchEvent("pointerdown");
  await second.getByText("stall is also used by stall: stall-2 now has the calibration stall-2.").waitFor();
  assert.deepEqual([(await stored("stall")).ignore, (await stored("stall-2")).ignore.length], [undefined, 1]);
});

/** Sends a frame of a named camera. Runs in the page. */
const sendFrame = async (key) => {
  const frame = await (await fetch("assets/office.jpg")).blob();
  const headers = { "X-API-Key": key };
  await fetch("detect?camera=door&profile=fast", { method: "POST", body: frame, headers });
};

pageTest(
  "a server with keys asks for one, and works with it",
  "#detect",
  async (page) => {
    const dialog = page.getByRole("dialog", { name: "Key" });
    await dialog.waitFor();
    await dialog.getByText("This server requires a valid API key").waitFor();
    await assertAccessible(page);
    await dialog.getByLabel("API key").fill(process.env.LOOKDOWN_KEY);
    await page.keyboard.press("Enter");
    await page.locator("#calibration option[value=office]").waitFor({ state: "attached" });
    await detectSample(page, "office", "office");
    await page.evaluate(sendFrame, process.env.LOOKDOWN_KEY);
    await go(page, "Cameras");
    await page.getByRole("article", { name: "Camera door" }).waitFor();
    assert.equal(await page.getByRole("article", { name: "Camera web-page" }).count(), 0);
    assert.equal(await page.evaluate(() => localStorage.length), 0);
  },
  { server: process.env.LOOKDOWN_KEYED_URL, expected: /status of 401/ },
);
