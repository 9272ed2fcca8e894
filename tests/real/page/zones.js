/** The section Zones. */

import assert from "node:assert/strict";
import { PHONE, SERVER, assertAccessible, assertFits, detectSample, pageTest, reportAfter } from "./browser.js";

const go = (page, name) => page.getByRole("navigation").getByRole("link", { name }).click();
const address = (id) => `${SERVER}/calibrations/${id}`;
const stored = async (id) => (await fetch(address(id))).json();
const put = (id, file) => fetch(address(id), { method: "PUT", body: JSON.stringify(file) });

const TRIANGLE = [[300, 300], [600, 300], [450, 600]];

/** Stores a copy of the calibration `office` with these fields. */
async function storeCopy(id, fields = {}) {
  const answer = await put(id, { ...(await stored("office")), id, ...fields });
  assert.ok(answer.ok, await answer.text());
}

/** Opens Zones with a frame and the calibration `id`. */
async function start(page, id) {
  await page.reload();
  await go(page, "Detect");
  await detectSample(page, "office", id);
  await go(page, "Zones");
  await page.locator("#zones-content").waitFor();
  await page.locator("#zones-save").getByText(`Save ${id}`).waitFor();
  await page.locator("#zones-stage").evaluate((stage) => stage.scrollIntoView({ block: "center" }));
}

/** The position on the screen of a place of the frame, which has 960 × 960 pixels. */
async function onScreen(page, [x, y]) {
  const box = await page.locator("#areas").boundingBox();
  const scale = Math.min(box.width, box.height) / 960;
  return [box.x + box.width / 2 + (x - 480) * scale, box.y + box.height / 2 + (y - 480) * scale];
}

async function click(page, place) {
  await page.mouse.click(...(await onScreen(page, place)));
}

async function drag(page, from, to) {
  await page.mouse.move(...(await onScreen(page, from)));
  await page.mouse.down();
  await page.mouse.move(...(await onScreen(page, to)), { steps: 5 });
  await page.mouse.up();
}

const draw = (page, kind) => page.getByRole("group", { name: "Draw" }).getByRole("button", { name: kind }).click();
const save = (page, id) => page.getByRole("button", { name: `Save ${id}` }).click();

async function saveAndWait(page, id) {
  await reportAfter(page, () => save(page, id));
  await page.getByText(`${id} is saved and in use.`).waitFor();
}

const near = (corners, expected, tolerance = 3) => {
  assert.equal(corners.length, expected.length);
  for (const [index, [x, y]] of corners.entries()) {
    assert.ok(Math.hypot(x - expected[index][0], y - expected[index][1]) <= tolerance, JSON.stringify(corners));
  }
};

pageTest("a drawn zone is saved, and shown again after a reload", "#detect", async (page) => {
  await storeCopy("drawn");
  await start(page, "drawn");
  await draw(page, "Zone");
  for (const place of TRIANGLE) await click(page, place);
  await click(page, TRIANGLE[0]);
  await page.getByRole("textbox", { name: "Name" }).fill("till");
  await page.getByText("Unsaved changes").waitFor();
  await saveAndWait(page, "drawn");
  const { zones, mount } = await stored("drawn");
  assert.equal(mount.height_m, 2.9);
  assert.equal(zones.length, 1);
  assert.equal(zones[0].name, "till");
  near(zones[0].frame_px, TRIANGLE);
  await start(page, "drawn");
  await page.locator(".area.zone").waitFor();
  await page.getByRole("button", { name: /^Zone till 3 corners, in the frame/ }).waitFor();
});

pageTest("a zone has the server's count of persons before it is saved", "#detect", async (page) => {
  await storeCopy("counted");
  await start(page, "counted");
  await draw(page, "Zone");
  for (const place of [[5, 5], [955, 5], [955, 480], [5, 480]]) await click(page, place);
  await page.keyboard.press("Enter");
  const count = await page.locator(".area-row .count").textContent();
  const report = await reportAfter(page, () => save(page, "counted"));
  const [zone] = report.zones;
  assert.ok(zone.persons > 0 && zone.persons < report.persons.length, JSON.stringify(report.zones));
  assert.equal(count, `${zone.persons} person${zone.persons === 1 ? "" : "s"}`);
});

pageTest("corners and areas are dragged, and undo restores them", "#detect", async (page) => {
  await storeCopy("dragged", { zones: [{ name: "hall", frame_px: TRIANGLE }] });
  await start(page, "dragged");
  await click(page, [450, 400]);
  await drag(page, TRIANGLE[2], [500, 700]);
  await drag(page, [450, 400], [470, 380]);
  // The small dot in the middle of an edge adds a corner.
  await drag(page, [470, 280], [470, 200]);
  await saveAndWait(page, "dragged");
  near((await stored("dragged")).zones[0].frame_px, [[320, 280], [470, 200], [620, 280], [520, 680]]);
  const undo = page.getByRole("button", { name: "Undo" });
  for (const _ of [1, 2, 3]) await undo.click();
  assert.ok(await undo.isDisabled());
  await page.keyboard.press("Control+Shift+z");
  assert.ok(await undo.isEnabled());
  await page.keyboard.press("Control+z");
  await saveAndWait(page, "dragged");
  assert.deepEqual((await stored("dragged")).zones[0].frame_px, TRIANGLE);
});

pageTest("everything is drawn and edited with the keyboard", "#detect", async (page) => {
  await storeCopy("keys");
  await start(page, "keys");
  await page.getByRole("group", { name: "Draw" }).getByRole("button", { name: "Mask" }).focus();
  await page.keyboard.press("Enter");
  const keys = async (key, times) => {
    for (let time = 0; time < times; time += 1) await page.keyboard.press(key);
  };
  await page.keyboard.press("Enter");
  await keys("Shift+ArrowRight", 3);
  await page.keyboard.press("Enter");
  await keys("Shift+ArrowDown", 4);
  await page.keyboard.press("Enter");
  await keys("Shift+ArrowLeft", 3);
  await page.keyboard.press("Enter");
  // Enter at a corner that is there finishes.
  await page.keyboard.press("Enter");
  await saveAndWait(page, "keys");
  assert.deepEqual((await stored("keys")).masks, [{ frame_px: [[480, 480], [540, 480], [540, 560], [480, 560]] }]);
  await page.getByRole("button", { name: /^Corner 1/ }).focus();
  await keys("ArrowLeft", 2);
  await page.getByRole("button", { name: /^Corner 3/ }).focus();
  await page.keyboard.press("Delete");
  await saveAndWait(page, "keys");
  assert.deepEqual((await stored("keys")).masks, [{ frame_px: [[476, 480], [540, 480], [480, 560]] }]);
  await page.getByRole("button", { name: /^Corner 1/ }).focus();
  await page.keyboard.press("Delete");
  await page.getByText("A mask has at least 3 corners.").waitFor();
  await page.keyboard.press("Escape");
  await page.keyboard.press("Delete");
  assert.equal(await page.locator(".area").count(), 0);
  // Escape cancels a drawing.
  await draw(page, "Line");
  await page.keyboard.press("Enter");
  await page.keyboard.press("Escape");
  await page.getByText("Drawing cancelled.").waitFor();
  await saveAndWait(page, "keys");
  assert.equal((await stored("keys")).masks, undefined);
});

pageTest("taps draw a zone on a phone", "#detect", async (page) => {
  await storeCopy("tapped");
  await start(page, "tapped");
  const tap = async (place) => page.touchscreen.tap(...(await onScreen(page, place)));
  await page.getByRole("group", { name: "Draw" }).getByRole("button", { name: "Zone" }).tap();
  await page.getByText("Click the corners.").waitFor();
  await assertFits(page);
  await assertAccessible(page);
  for (const place of [...TRIANGLE, TRIANGLE[0]]) await tap(place);
  // A tapped corner is selected, and its button deletes it.
  await page.getByRole("button", { name: "Add a corner after corner 3" }).tap();
  await page.getByRole("button", { name: /^Corner 4/ }).waitFor();
  await tap(TRIANGLE[1]);
  await page.getByRole("button", { name: "Delete corner" }).tap();
  await saveAndWait(page, "tapped");
  near((await stored("tapped")).zones[0].frame_px, [TRIANGLE[0], TRIANGLE[2], [375, 450]], 6);
}, { viewport: PHONE, hasTouch: true });

pageTest("a line has named directions, which can be turned", "#detect", async (page) => {
  await storeCopy("lined");
  await start(page, "lined");
  await draw(page, "Line");
  await click(page, [300, 500]);
  await click(page, [600, 500]);
  await page.getByRole("textbox", { name: "Name" }).fill("door");
  await page.getByLabel("Along the arrow").fill("enter");
  await page.getByLabel("Against it").fill("leave");
  await page.getByRole("button", { name: "Turn the arrow" }).click();
  await saveAndWait(page, "lined");
  const [line] = (await stored("lined")).lines;
  assert.deepEqual([line.name, line.directions], ["door", ["enter", "leave"]]);
  near(line.frame_px, [[600, 500], [300, 500]]);
});

pageTest("a zone is drawn on the floor, in meters", "#detect", async (page) => {
  await storeCopy("floored");
  await start(page, "floored");
  await page.getByRole("radio", { name: "Floor" }).check();
  await page.locator("#areas .dot-mark").first().waitFor();
  assert.ok(await page.getByRole("group", { name: "Draw" }).getByRole("button", { name: "Mask" }).isDisabled());
  await draw(page, "Zone");
  for (const place of [[480, 480], [720, 480], [720, 720]]) await click(page, place);
  await page.getByRole("button", { name: "Finish" }).click();
  await saveAndWait(page, "floored");
  const [{ floor_m: corners }] = (await stored("floored")).zones;
  near(corners.slice(0, 1), [[0, 0]], 0.05);
  // It is seen over the frame, too, where its first corner is below the camera.
  await page.getByRole("radio", { name: "Frame" }).check();
  const outline = await page.locator("#areas .fixed.zone .outline").getAttribute("points");
  near([outline.split(" ")[0].split(",").map(Number)], [[480, 480]], 12);
  const [[, [right], [, down]]] = [corners];
  assert.ok(right > 1 && right < 20 && Math.abs(down - right) < 0.05, JSON.stringify(corners));
});

pageTest("the floor needs the height of the camera", "#detect", async (page) => {
  await storeCopy("low", { mount: { world_up: [0, 0, -1] } });
  await start(page, "low");
  assert.ok(await page.getByRole("radio", { name: "Floor" }).isDisabled());
  await page.getByText("The floor map needs the height of the camera").waitFor();
});

pageTest("a concurrent change is reported, and the drawing is kept", "#detect", async (page) => {
  const other = { name: "other", frame_px: [[10, 400], [100, 400], [100, 500]] };
  await storeCopy("contested");
  await start(page, "contested");
  await draw(page, "Zone");
  for (const place of TRIANGLE) await click(page, place);
  await page.getByRole("button", { name: "Finish" }).click();
  await storeCopy("contested", { zones: [other], mount: { world_up: [0, 0, -1], height_m: 3.3 } });
  await save(page, "contested");
  const conflict = page.getByRole("alert").filter({ hasText: "Not saved: contested was changed elsewhere" });
  await conflict.waitFor();
  await assertAccessible(page);
  assert.deepEqual((await stored("contested")).zones, [other]);
  await page.locator(".area.zone").waitFor();
  // The other version replaces the drawing, which undo brings back.
  await conflict.getByRole("button", { name: "Take the other version" }).click();
  await page.getByRole("button", { name: /^Zone other/ }).last().waitFor();
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByRole("button", { name: /^Zone zone-1/ }).last().waitFor();
  await storeCopy("contested", { zones: [], mount: { world_up: [0, 0, -1], height_m: 3.4 } });
  await save(page, "contested");
  await reportAfter(page, () => conflict.getByRole("button", { name: "Save my drawing" }).click());
  await page.getByText("contested is saved and in use.").waitFor();
  const { zones, mount } = await stored("contested");
  near(zones[0].frame_px, TRIANGLE);
  assert.equal(mount.height_m, 3.4);
}, { expected: /status of 412/ });

pageTest("the server's refusal is shown at the area that it names", "#detect", async (page) => {
  await storeCopy("refused", { zones: [{ name: "a", frame_px: TRIANGLE }, { name: "b", frame_px: [[700, 700], [800, 700], [800, 800]] }] });
  await start(page, "refused");
  await page.getByRole("button", { name: /^Zone b 3 corners/ }).click();
  await page.getByRole("textbox", { name: "Name" }).fill("a");
  await save(page, "refused");
  await page.locator(".area-row").nth(1).getByRole("alert").getByText("Another zone is called \"a\", too: rename one.").waitFor();
  await page.getByText("Not saved: see zone a.").waitFor();
  await page.getByRole("textbox", { name: "Name" }).fill("c");
  assert.equal(await page.getByRole("alert").count(), 0);
  await saveAndWait(page, "refused");
  assert.equal(await page.getByRole("alert").count(), 0);
  // An outline that crosses itself.
  await draw(page, "Zone");
  for (const place of [[100, 400], [200, 500], [100, 500], [200, 400]]) await click(page, place);
  await page.getByRole("button", { name: "Finish" }).click();
  await save(page, "refused");
  await page.locator(".area-row").nth(2).getByRole("alert").getByText("the edge from corner").waitFor();
  assert.equal(await page.locator(".area.invalid").getAttribute("aria-label"), "Zone zone-1, 0 persons");
}, { expected: /status of 422/ });

pageTest("the circle editor keeps zones, lines and masks", "#detect", async (page) => {
  const areas = {
    zones: [{ name: "till", frame_px: TRIANGLE }],
    lines: [{ name: "door", frame_px: [[300, 500], [620, 480]], directions: ["enter", "leave"] }],
    masks: [{ frame_px: [[10, 10], [100, 10], [100, 100]] }],
    detect: { profile: "fast" },
  };
  await storeCopy("circled", areas);
  await page.reload();
  await detectSample(page, "office", "");
  await go(page, "Calibrate");
  await page.locator("#previews canvas").nth(3).waitFor();
  const kept = async () => {
    const { zones, lines, masks, detect, mount } = await stored("circled");
    assert.deepEqual({ zones, lines, masks, detect }, areas);
    return mount.height_m;
  };
  // Saving over it, and opening it first.
  const saved = page.getByText("circled is saved and in use.");
  await page.getByLabel("Name", { exact: true }).first().fill("circled");
  await page.getByLabel("Height, meters").fill("3.1");
  await page.getByRole("button", { name: "Replace circled" }).click();
  await saved.waitFor();
  assert.equal(await kept(), 3.1);
  await page.locator("#open-calibration").selectOption("circled");
  await page.waitForFunction(() => !document.querySelector("#circle-fields").disabled);
  await page.getByLabel("Height, meters").fill("3.2");
  await page.getByRole("button", { name: "Replace circled" }).click();
  await saved.waitFor();
  assert.equal(await kept(), 3.2);
  // Another lens or mount is a conflict. The second save replaces it.
  await storeCopy("circled", { ...areas, mount: { world_up: [0, 0, -1], height_m: 4 } });
  await page.getByLabel("Height, meters").fill("3.3");
  await page.getByRole("button", { name: "Replace circled" }).click();
  await page.getByRole("alert").getByText("circled has another lens or mount since it was opened here.").waitFor();
  assert.equal(await kept(), 4);
  await page.getByRole("button", { name: "Replace circled" }).click();
  await saved.waitFor();
  assert.equal(await kept(), 3.3);
});
