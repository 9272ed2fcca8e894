/** Every section at the width of a desk and of a telephone, in light and dark: nothing reaches beyond the edge, and
 * axe-core finds nothing. The pictures in docs/images are made here. */

import { PHONE, WIDE, assertAccessible, assertFits, detectSample, pageTest, picture } from "./browser.js";

const SECTIONS = {
  Views: ".tile",
  Floor: ".dot-mark",
  Calibrate: "#previews canvas",
  Live: ".card .plot",
};

for (const [device, viewport] of [["wide", WIDE], ["phone", PHONE]]) {
  for (const colorScheme of ["light", "dark"]) {
    const look = async (page) => {
      const name = `${device}-${colorScheme}`;
      await assertFits(page);
      await assertAccessible(page);
      await picture(page, `empty-${name}`);
      await detectSample(page, "office", "office");
      await assertFits(page);
      await assertAccessible(page);
      await picture(page, `detect-${name}`);
      for (const [section, sign] of Object.entries(SECTIONS)) {
        await page.getByRole("navigation").getByRole("link", { name: section }).click();
        await page.locator(sign).first().waitFor();
        await assertFits(page);
        await assertAccessible(page);
        await picture(page, `${section.toLowerCase()}-${name}`);
      }
    };
    pageTest(`every section is well on a ${device} screen in ${colorScheme}`, "", look, { viewport, colorScheme });
  }
}
