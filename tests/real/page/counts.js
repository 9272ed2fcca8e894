/** The section Cameras of a server that forwards to `lookdown count`. */

import assert from "node:assert/strict";
import { readFile, readdir } from "node:fs/promises";
import test from "node:test";
import { PHONE, SERVER, WIDE, assertAccessible, assertFits, pageTest, screenshot } from "./browser.js";

/** The address of the server, that of one whose counts are gone, a folder of frames of a walk, and its true crossings. */
const { LOOKDOWN_COUNTED_URL: COUNTED, LOOKDOWN_UNCOUNTED_URL: UNCOUNTED, LOOKDOWN_WALK: WALK } = process.env;
const TRUTH = JSON.parse(await readFile(process.env.LOOKDOWN_WALK_TRUTH, "utf8"));
const FRAMES_PER_SECOND = TRUTH.frames_per_second;
/** As docs/count.md recommends for counted cameras. */
const SCORE_THRESHOLD = 0.06;
/** Missed and invented crossings that the test permits, as that of the end-to-end counts. */
const WRONG = 1;

/** Sends the frames like a camera, with their capture times; the last one is of now. */
async function walk(camera) {
  const names = (await readdir(WALK)).sort((one, other) => parseInt(one, 10) - parseInt(other, 10));
  const first = Date.now() - (names.length / FRAMES_PER_SECOND) * 1000;
  for (const [index, name] of names.entries()) {
    const captured = new Date(first + (index / FRAMES_PER_SECOND) * 1000).toISOString();
    const settings = { calibration: "walks", camera, profile: "fast", score_threshold: SCORE_THRESHOLD };
    const parameters = new URLSearchParams({ ...settings, captured_at: captured });
    const answer = await fetch(`${COUNTED}/detect?${parameters}`, { method: "POST", body: await readFile(`${WALK}/${name}`) });
    assert.equal(answer.status, 200);
  }
}

/** The crossings that a card shows: a number for each direction of each line, like `truth`. */
async function shownCrossings(card, truth) {
  const shown = {};
  for (const [line, directions] of Object.entries(truth)) {
    const text = await card.locator(".of-line").filter({ hasText: line }).textContent();
    const numbers = Object.keys(directions).map((direction) => [direction, Number(text.match(`(\\d+) [→↘↓↙←↖↑↗] ${direction}`)[1])]);
    shown[line] = Object.fromEntries(numbers);
  }
  return shown;
}

/** The sum of the differences of two tables of crossings. */
function differences(some, others) {
  const pairs = Object.entries(some).flatMap(([line, directions]) => Object.entries(directions).map(([name, count]) => [count, others[line][name]]));
  return pairs.reduce((sum, [one, other]) => sum + Math.abs(one - other), 0);
}

test("a camera sends frames of a walk", () => walk("hall"));

test("a camera sends a frame to a server whose counts are gone", async () => {
  const [frame] = await readdir(WALK);
  const body = await readFile(`${WALK}/${frame}`);
  const answer = await fetch(`${UNCOUNTED}/detect?camera=hall&profile=fast`, { method: "POST", body });
  assert.equal(answer.status, 200);
});

for (const [device, viewport, colorScheme] of [["wide", WIDE, "light"], ["phone", PHONE, "dark"]]) {
  pageTest(
    `tracks, lines, zones and the heat map are drawn over a camera on a ${device} screen`,
    "#cameras",
    async (page) => {
      const card = page.getByRole("article", { name: "Camera hall" });
      await card.locator(".track").first().waitFor();
      const tails = await card.locator(".track polyline").evaluateAll((nodes) => nodes.map((node) => node.getAttribute("points").split(" ").length));
      assert.ok(Math.max(...tails) > 5, `${tails}`);
      const lineColors = await card.locator(".count-line").evaluateAll((lines) => lines.map((line) => getComputedStyle(line).stroke));
      assert.equal(new Set(lineColors).size, 2);
      assert.equal(await card.locator(".count-zone").count(), 1);
      const shown = await shownCrossings(card, TRUTH.crossings);
      const wrong = differences(shown, TRUTH.crossings);
      assert.ok(wrong <= WRONG, `shown ${JSON.stringify(shown)}, true ${JSON.stringify(TRUTH.crossings)}`);
      await card.getByRole("listitem").filter({ hasText: /middle\d+ now, \d+ entered/ }).waitFor();
      await assertFits(page);
      await assertAccessible(page);
      await page.getByLabel("Heat map").check();
      await card.locator("image").waitFor();
      if (device === "wide") await screenshot(page, "counts-wide");
      await page.getByLabel("Heat map").uncheck();
      await card.locator("image").waitFor({ state: "detached" });
    },
    { server: COUNTED, viewport, colorScheme },
  );
}

pageTest(
  "a thing that stands still is taken out of the count and counted again",
  "#camera/shop",
  async (page) => {
    const card = page.getByRole("article", { name: "Camera shop" });
    const json = async (path) => (await fetch(`${COUNTED}/${path}`)).json();
    const isFollowed = async ({ outline_px: outline }) => {
      const [xs, ys] = [0, 1].map((axis) => outline.map((corner) => corner[axis]));
      const isInside = ([x, y]) => x > Math.min(...xs) && x < Math.max(...xs) && y > Math.min(...ys) && y < Math.max(...ys);
      return (await json("counts/shop/tracks")).tracks.some(({ frame_px: foot }) => isInside(foot));
    };
    // A track ends some seconds after its last box.
    const untilFollowed = async (thing, is) => {
      for (let attempt = 0; attempt < 200 && (await isFollowed(thing)) !== is; attempt += 1) await page.waitForTimeout(100);
      assert.equal(await isFollowed(thing), is);
    };
    // The camera has sent the same frame since the tests began. Presence is real time.
    await card.getByText(/^\d persons? standing still$/).click({ timeout: 120_000 });
    const listed = (await json("cameras/shop/furniture"))[0];
    await untilFollowed(listed, true);
    const thing = card.getByRole("listitem").filter({ hasText: new RegExp(`^${listed.id}: counted, stands still for \\d min`) });
    await assertAccessible(page);
    await thing.waitFor();
    await thing.getByRole("button", { name: `Not a person: thing ${listed.id} of shop` }).click();
    await card.getByText(`${listed.id} is furniture and is not counted.`).waitFor();
    await card.getByText("1 thing not counted").waitFor();
    await card.locator(".count-furniture").waitFor();
    await untilFollowed(listed, false);
    await card.getByRole("button", { name: `Is a person: thing ${listed.id} of shop` }).click();
    await card.getByText(/^\d persons? standing still$/).waitFor();
    await untilFollowed(listed, true);
  },
  { server: COUNTED },
);

pageTest(
  "the area in which people walked is added and saved",
  "#cameras",
  async (page) => {
    const card = page.getByRole("article", { name: "Camera hall" });
    await card.getByRole("button", { name: "Zones" }).click();
    await page.getByRole("button", { name: "Area from walks" }).click();
    await page.getByRole("button", { name: /^Area 1 \d+ corners, on the floor/ }).waitFor();
    await screenshot(page, "area-from-walks");
    await page.getByRole("button", { name: "Save walks" }).click();
    await page.getByText("walks is saved and in use.").waitFor();
    const { areas } = await (await fetch(`${COUNTED}/calibrations/walks`)).json();
    assert.equal(areas.length, 1);
    // Five people walk around the middle of the room.
    const reach = Math.max(...areas[0].floor_m.flat().map(Math.abs));
    assert.ok(reach > 2 && reach < 8, JSON.stringify(areas));
  },
  { server: COUNTED },
);

pageTest(
  "the floor shows the newest report of the camera whose frame is used",
  "#cameras",
  async (page) => {
    let count = 1;
    await page.route("**/results/hall/latest", async (route) => {
      const report = await (await route.fetch()).json();
      report.persons = Array.from({ length: count }, () => ({ ...report.persons[0], floor: { x_m: 1, y_m: count } }));
      await route.fulfill({ json: report });
    });
    const card = page.getByRole("article", { name: "Camera hall" });
    await card.getByRole("button", { name: "Floor" }).click();
    const places = page.getByRole("table", { name: "Positions on the floor" });
    await places.getByRole("row", { name: "1 1.00 m 1.00 m 1.41 m" }).waitFor();
    count = 2;
    await places.getByRole("row", { name: "2 1.00 m 2.00 m 2.24 m" }).waitFor();
  },
  { server: COUNTED },
);

pageTest(
  "crossings that a person counted are sent, and an hour without frames is refused",
  "#camera/hall",
  async (page) => {
    await page.route(/counts\/hall\?.*step=1h/, async (route) => {
      const counts = await (await route.fetch()).json();
      for (const step of counts.steps) step.known_seconds = 3600;
      await route.fulfill({ json: counts });
    });
    // The page may have asked already.
    await page.reload();
    const section = page.getByRole("region", { name: "Crossings of hall" });
    await section.getByRole("button", { name: "Count the crossings of an hour" }).click();
    for (const field of await section.getByRole("spinbutton").all()) await field.fill("3");
    await page.setViewportSize(PHONE);
    await assertFits(page);
    await assertAccessible(page);
    await section.getByRole("button", { name: "Save" }).click();
    await section.getByText("the camera was not counted for nine tenths of this hour").waitFor();
    assert.deepEqual((await (await fetch(`${COUNTED}/counts/hall/reference-crossings`)).json()).crossings, []);
  },
  { server: COUNTED, expected: /status of 422/ },
);

pageTest(
  "counts that cannot be reached are one sentence, and the cards stay",
  "#cameras",
  async (page) => {
    await page.getByText("The counts cannot be read: the log of the server has the reason.").waitFor();
    await page.getByRole("article", { name: "Camera hall" }).locator(".plot").waitFor();
    assert.equal(await page.locator(".counts").count(), 0);
    assert.equal(await page.getByLabel("Heat map").isVisible(), false);
  },
  { server: UNCOUNTED, expected: /status of 503/ },
);

pageTest(
  "a camera alone lists each line once, with the crossings of today, above the fold",
  "#camera/hall",
  async (page) => {
    const card = page.getByRole("article", { name: "Camera hall" });
    await card.locator(".of-line").filter({ hasText: "(today" }).first().waitFor();
    assert.equal(await card.getByRole("listitem").filter({ hasText: "clockwise" }).count(), 2);
    for (const viewport of [{ width: 1280, height: 800 }, PHONE]) {
      await page.setViewportSize(viewport);
      for (const part of [".sight", ".big"]) {
        const { y, height } = await card.locator(part).boundingBox();
        assert.ok(y + height <= viewport.height, `${part} ends at ${y + height}`);
      }
    }
  },
  { server: COUNTED },
);

pageTest("a page without a path of counts asks for none", "#cameras", async (page) => {
  await page.getByRole("heading", { name: "Cameras", level: 1 }).waitFor();
  await page.waitForTimeout(500);
  assert.equal(await page.locator("#counts-bar").count(), 0);
}, { server: SERVER });
