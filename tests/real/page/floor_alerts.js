/** The alert of someone who fell, in the section Cameras of `lookdown run`. */

import assert from "node:assert/strict";
import { assertAccessible, assertFits, pageTest, screenshot } from "./browser.js";

const RUN = process.env.LOOKDOWN_FALL_URL;

pageTest(
  "someone who fell has a red frame until the alert is acknowledged",
  "#camera/room",
  async (page) => {
    const card = page.getByRole("article", { name: "Camera room" });
    const alert = card.getByRole("alert");
    await alert.getByText(/^Someone is lying near window since \d/).waitFor();
    const isRed = () => card.evaluate((node) => node.classList.contains("has-floor-alert"));
    assert.ok(await isRed());
    await assertFits(page);
    await assertAccessible(page);
    await screenshot(page, "floor-alert-wide");
    await alert.getByRole("button", { name: /^Acknowledge: Someone is lying near window since .*, room$/ }).click();
    await alert.getByText(/, acknowledged$/).waitFor();
    assert.equal(await isRed(), false);
    const [{ is_acknowledged: isAcknowledged, posture }] = (await (await fetch(`${RUN}/counts/room/floor`)).json()).persons;
    assert.deepEqual([isAcknowledged, posture], [true, "lying"]);
  },
  { server: RUN },
);
