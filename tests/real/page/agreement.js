/** The page's lens and grids compared with the server's calibrations. */

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import test from "node:test";
import { calibrationOf } from "../../../web/lens.js";
import { SAMPLES, SERVER } from "./browser.js";

const CELLS = 16;
const circle = { width: 960, height: 960, model: "equidistant", cx: 480, cy: 480, radius: 480, fieldOfView: 180, cameraHeight: 2.9 };

async function plan(path, options) {
  const answer = await fetch(`${SERVER}/${path}`, options);
  assert.equal(answer.status, 200, await answer.clone().text());
  return answer.json();
}

test("a lens of the page equals the saved calibration of the same lens", async () => {
  const body = JSON.stringify(calibrationOf({ id: "trial", ...circle }));
  const tried = await plan("calibrations/trial/views?profile=balanced", { method: "POST", body });
  const saved = await plan("calibrations/office/views?profile=balanced");
  assert.equal(tried.views.length, saved.views.length);
  for (const [index, view] of tried.views.entries()) {
    for (const [point, [x, y]] of view.outline.entries()) {
      const [savedX, savedY] = saved.views[index].outline[point];
      assert.ok(Math.hypot(x - savedX, y - savedY) < 0.01, `view ${index}`);
    }
  }
  const after = await fetch(`${SERVER}/calibrations/trial`);
  assert.equal(after.status, 404, "nothing is stored");
});

test("the border of a grid is the outline of its view within the lens image", async () => {
  const { views } = await plan(`calibrations/office/views?profile=balanced&grid=${CELLS}`);
  const side = CELLS + 1;
  for (const { grid, outline } of views) {
    assert.equal(grid.length, side * side);
    for (let step = 0; step <= CELLS; step += 1) {
      const node = grid[step];
      if (node) assert.ok(Math.hypot(node[0] - outline[step][0], node[1] - outline[step][1]) < 0.01);
    }
  }
});

test("a saved calibration equals that of the page", async () => {
  const { lens } = JSON.parse(await readFile(`${SAMPLES}/calibrations/office.json`, "utf8"));
  const own = calibrationOf({ id: "office", ...circle }).lens;
  assert.ok(Math.abs(own.focal - lens.focal) < 1e-3 && own.cx === lens.cx && own.cy === lens.cy);
});
