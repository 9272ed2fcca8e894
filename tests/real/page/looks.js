/** Every section on a wide screen and on a phone, in light and dark mode: no horizontal overflow, and no violation
 * of axe-core. The screenshots in docs/images are made here. */

import test from "node:test";
import { PHONE, WIDE, assertAccessible, assertFits, detectSample, pageTest, picture, post } from "./browser.js";

const SECTIONS = {
  Views: ".tile",
  Floor: ".dot-mark",
  Calibrate: "#previews canvas",
  Live: ".card .plot",
};

test("cameras have something to show", async () => {
  for (const threshold of [0.3, 0.45, 0.6, 0.5, 0.3, 0.35]) {
    for (const sample of ["office", "canteen", "lounge"]) await post(sample, sample, `profile=fast&score_threshold=${threshold}`);
  }
});

for (const [device, viewport] of [["wide", WIDE], ["phone", PHONE]]) {
  for (const colorScheme of ["light", "dark"]) {
    const look = async (page) => {
      // The wide screen in light mode, the phone in dark mode.
      const isKept = (device === "wide") === (colorScheme === "light");
      const keep = (name) => isKept && picture(page, `${name}-${device}`);
      await assertFits(page);
      await assertAccessible(page);
      await keep("empty");
      await detectSample(page, "office", "office");
      await assertFits(page);
      await assertAccessible(page);
      await keep("detect");
      for (const [section, sign] of Object.entries(SECTIONS)) {
        await page.getByRole("navigation").getByRole("link", { name: section }).click();
        await page.locator(sign).first().waitFor();
        if (section === "Views") await page.locator(sign).nth(6).click();
        await assertFits(page);
        await assertAccessible(page);
        await keep(section.toLowerCase());
      }
    };
    pageTest(`every section is well on a ${device} screen in ${colorScheme}`, "", look, { viewport, colorScheme });
  }
}
