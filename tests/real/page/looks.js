/** Every section on a wide screen and on a phone, in light and dark mode: no horizontal overflow, and no violation
 * of axe-core. The screenshots in docs/images are made here. */

import assert from "node:assert/strict";
import test from "node:test";
import { PHONE, SERVER, WIDE, assertAccessible, assertFits, detectSample, pageTest, post, reportAfter, screenshot } from "./browser.js";

const SECTIONS = {
  Views: ".tile",
  Floor: ".dot-mark",
  Calibrate: "#previews canvas",
  Zones: "#zones-content",
  Cameras: ".card .plot",
};

/** The areas of the calibration `hall`, which is `office` otherwise. */
const AREAS = {
  zones: [
    { name: "lounge", frame_px: [[371, 385], [523, 393], [749, 482], [789, 627], [620, 771], [475, 739], [362, 610]] },
    { name: "exhibition", frame_px: [[395, 210], [590, 185], [735, 295], [700, 370], [520, 260], [340, 265]] },
    { name: "entrance", floor_m: [[-2.6, -1.6], [-1.2, -1.6], [-1.2, 0.6], [-2.6, 0.6]] },
  ],
  lines: [{ name: "door", frame_px: [[802, 430], [794, 540]], directions: ["enter", "leave"] }],
  masks: [{ frame_px: [[105, 290], [205, 345], [178, 448], [70, 425]] }],
};

test("cameras have something to show", async () => {
  const office = await (await fetch(`${SERVER}/calibrations/office`)).json();
  const hall = { method: "PUT", body: JSON.stringify({ ...office, id: "hall", ...AREAS }) };
  assert.ok((await fetch(`${SERVER}/calibrations/hall`, hall)).ok);
  for (const threshold of [0.3, 0.45, 0.6, 0.5, 0.3, 0.35]) {
    for (const sample of ["office", "canteen", "lounge"]) await post(sample, sample, `profile=fast&score_threshold=${threshold}`);
  }
});

/** Selects a zone of `hall`. */
async function editZones(page) {
  await reportAfter(page, () => page.locator("#zones-calibration").selectOption("hall"));
  await page.locator(".area-row .count").getByText("person").first().waitFor();
  await page.getByRole("button", { name: /^Zone lounge [0-9]/ }).click();
}

for (const [device, viewport] of [["wide", WIDE], ["phone", PHONE]]) {
  for (const colorScheme of ["light", "dark"]) {
    const look = async (page) => {
      // The wide screen in light mode, the phone in dark mode.
      const isKept = (device === "wide") === (colorScheme === "light");
      const keep = (name) => isKept && screenshot(page, `${name}-${device}`);
      await assertFits(page);
      await assertAccessible(page);
      await keep("empty");
      await detectSample(page, "office", "office");
      await assertFits(page);
      await assertAccessible(page);
      await keep("detect");
      if (device === "phone") {
        const [persons, timings] = await Promise.all(["#persons", "#timings"].map((of) => page.locator(of).boundingBox()));
        assert.ok(persons.y < timings.y, "the persons are above the times");
      }
      for (const [section, sign] of Object.entries(SECTIONS)) {
        await page.getByRole("navigation").getByRole("link", { name: section }).click();
        await page.locator(sign).first().waitFor();
        if (section === "Views") await page.locator(sign).nth(6).click();
        if (section === "Zones") await editZones(page);
        await assertFits(page);
        await assertAccessible(page);
        await keep(section.toLowerCase());
      }
    };
    pageTest(`every section is well on a ${device} screen in ${colorScheme}`, "#detect", look, { viewport, colorScheme });
  }
}
