/** The areas of the section Zones: reading, writing, editing, undo. */

import assert from "node:assert/strict";
import test from "node:test";
import { personsIn } from "../../../web/area_counts.js";
import { foot, pointBelow } from "../../../web/geometry.js";
import { AreaEditor } from "../../../web/area_editor.js";
import { assumedFile, withIgnored } from "../../../web/ignore_place.js";
import { areaOf, areasOf, freeName, movedBy, placed, problemOf, titleOf, withAreas } from "../../../web/areas.js";

const FRAME = [0, 0, 100, 100];
const SQUARE = [[10, 10], [30, 10], [30, 30], [10, 30]];
const FILE = {
  id: "lobby",
  image: { width: 100, height: 100 },
  zones: [{ name: "till", frame_px: SQUARE }, { name: "bed", floor_m: [[1, 1], [2, 1], [2, 2]], lying: "expected" }],
  lines: [{ name: "gate", frame_px: [[0, 50], [100, 50]], directions: ["enter", "leave"] }],
  masks: [{ frame_px: SQUARE }],
  areas: [{ floor_m: [[-3, -3], [3, -3], [3, 3]] }],
  ignore: [{ name: "chair", frame_px: SQUARE }],
  detect: { profile: "fast" },
};

test("areas survive reading and writing, with the rest of the file", () => {
  assert.deepEqual(withAreas(FILE, areasOf(FILE)), FILE);
  const { zones: _, lines: __, masks: ___, areas: ____, ignore: _____, ...rest } = FILE;
  assert.deepEqual(withAreas(FILE, []), rest);
});

test("a problem of the server names its area", () => {
  const areas = areasOf(FILE);
  const problem = problemOf('zones[1].name: another zone is called "a", too: rename one', areas);
  assert.equal(titleOf(areas.find(({ key }) => key === problem.key), areas), "zone bed");
  assert.equal(problem.text, 'Another zone is called "a", too: rename one.');
  assert.equal(problemOf("lines[0].directions: both are \"in\": rename one", areas).key, areas[2].key);
  assert.equal(problemOf("masks[0].frame_px: it has 2 corners: give 3 to 64", areas).key, areas[3].key);
  assert.equal(problemOf("areas[0].floor_m: it has 2 corners: give 3 to 64", areas).key, areas[4].key);
  assert.equal(problemOf("ignore[0].name: it is \"A\"", areas).key, areas[5].key);
  assert.deepEqual(areas.slice(3).map((area) => titleOf(area, areas)), ["mask 1", "area 1", "ignored place chair"]);
  assert.equal(problemOf("lens.focal: it is 0", areas), null);
});

test("places are rounded and stay inside the frame", () => {
  assert.deepEqual(placed("frame_px", [-4, 50.26], FRAME), [0, 50.3]);
  assert.deepEqual(placed("floor_m", [1.237, -0.001], [-9, -9, 9, 9]), [1.24, 0]);
  const moved = movedBy(areaOf("zone", "frame_px", "a", SQUARE), [-50, 5], FRAME);
  assert.deepEqual(moved.corners, [[0, 15], [20, 15], [20, 35], [0, 35]]);
});

test("new names are free", () => {
  const areas = [areaOf("zone", "frame_px", "zone-1", SQUARE), areaOf("line", "frame_px", "line-1", [])];
  assert.equal(freeName("zone", areas), "zone-2");
  assert.equal(freeName("line", areas), "line-2");
});

test("a drawn outline becomes an area, and undo removes it", () => {
  const editor = new AreaEditor([], () => {});
  editor.begin("zone", "frame_px", [50, 50]);
  for (const place of SQUARE) {
    editor.moveCursor(place, FRAME);
    editor.addAtCursor();
  }
  assert.equal(editor.areas.length, 0);
  editor.moveCursor(SQUARE[0], FRAME);
  editor.addAtCursor();
  assert.deepEqual(editor.selectedArea.corners, SQUARE);
  assert.ok(editor.isUnsaved);
  editor.undo();
  assert.deepEqual([editor.areas, editor.selected, editor.isUnsaved], [[], null, false]);
  editor.redo();
  assert.equal(editor.areas[0].name, "zone-1");
});

test("undo while drawing removes the last corner only", () => {
  const areas = areasOf(FILE);
  const editor = new AreaEditor(areas, () => {});
  editor.begin("line", "frame_px", [50, 50]);
  editor.addAtCursor();
  editor.undo();
  assert.deepEqual([editor.draft.corners, editor.areas], [[], areas]);
});

test("the moves of a drag are one step, which Escape reverts", () => {
  const editor = new AreaEditor(areasOf(FILE), () => {});
  const { key } = editor.areas[0];
  editor.moveCorner(key, 0, [11, 11], FRAME, "drag-1");
  editor.moveCorner(key, 0, [12, 12], FRAME, "drag-1");
  editor.moveCorner(key, 1, [40, 10], FRAME, "drag-2");
  editor.cancelChange("drag-2");
  assert.deepEqual(editor.area(key).corners.slice(0, 2), [[12, 12], [30, 10]]);
  editor.undo();
  assert.deepEqual(editor.area(key).corners, SQUARE);
  assert.ok(!editor.canUndo);
});

test("an area keeps the corners that it needs", () => {
  const editor = new AreaEditor(areasOf(FILE), () => {});
  const [square, triangle, line] = editor.areas.map(({ key }) => key);
  editor.removeCorner(square, 3);
  assert.equal(editor.area(square).corners.length, 3);
  editor.removeCorner(triangle, 0);
  assert.equal(editor.note, "A zone has at least 3 corners.");
  editor.removeCorner(line, 0);
  assert.equal(editor.note, "A line has two ends.");
});

test("a zone counts feet in the frame, and places on the floor", () => {
  // The feet are at 20, 20 and 20, 60 in frames of half the size of those of the calibration.
  const person = (cy, floor) => ({ oriented_box: { cx: 20, cy, width: 4, height: 20, angle_deg: 0 }, ...floor });
  const report = { image: { width: 50, height: 50 }, persons: [person(10, { floor: { x_m: 1.5, y_m: 1.2 } }), person(50)] };
  const zone = (space, corners) => areaOf("zone", space, "a", corners);
  assert.equal(personsIn(zone("frame_px", [[35, 35], [45, 35], [45, 45], [35, 45]]), report, FILE), 1);
  assert.equal(personsIn(zone("frame_px", [[35, 15], [45, 15], [45, 25], [35, 25]]), report, FILE), 0);
  assert.equal(personsIn(zone("floor_m", FILE.zones[1].floor_m), report, FILE), 1);
  assert.equal(personsIn(zone("floor_m", FILE.zones[1].floor_m), null, FILE), null);
});

test("the place of a person is ignored on the floor, or around the foot in the frame", () => {
  const report = { image: { width: 200, height: 200 } };
  const box = { cx: 150, cy: 100, width: 20, height: 60, angle_deg: 90 };
  const person = { oriented_box: box, floor: { x_m: 1, y_m: 2 } };
  const file = { id: "hall", image: { width: 100, height: 100 }, lens: { cx: 49.5, cy: 49.5 }, mount: { height_m: 3 } };
  const [onFloor] = withIgnored(file, person, report).ignore;
  assert.equal(onFloor.name, "ignore-1");
  assert.ok(onFloor.floor_m.every(([x, y]) => Math.abs(Math.hypot(x - 1, y - 2) - 0.5) < 0.02));
  const known = { ...file, mount: {}, ignore: [{ name: "ignore-1", frame_px: SQUARE }] };
  const [first, second] = withIgnored(known, { ...person, floor: null }, report).ignore;
  assert.deepEqual([first.name, second.name], ["ignore-1", "ignore-2"]);
  // The foot is toward the middle: at 120, 100 of 200 pixels, thus at 60, 50 of 100.
  assert.ok(second.frame_px.every(([x, y]) => Math.abs(Math.hypot(x - 60, y - 50) - 5) < 0.2), JSON.stringify(second));
});

test("the foot of a person is toward the point below a camera that looks down", () => {
  const report = { image: { width: 200, height: 200 } };
  const file = { image: { width: 100, height: 100 }, lens: { focal: 30, cx: 49.5, cy: 49.5 } };
  const box = (cx, cy, degrees) => ({ oriented_box: { cx, cy, width: 20, height: 40, angle_deg: degrees } });
  const below = pointBelow(file, report);
  assert.deepEqual(below, [100, 100]);
  assert.deepEqual(foot(box(100, 40, 0), below), [100, 60]);
  assert.deepEqual(foot(box(100, 160, 0), below), [100, 140]);
  // A camera on a wall sees feet at the lower end.
  const wall = pointBelow({ ...file, mount: { world_up: [0, -1, 0] } }, report);
  assert.deepEqual([wall, foot(box(100, 160, 0), wall)], [null, [100, 180]]);
  const [x, y] = pointBelow({ ...file, mount: { world_up: [0, -0.1, -0.995] } }, report);
  assert.ok(x === 100 && Math.abs(y - 106) < 0.1, `${x}, ${y}`);
});

test("an assumed lens becomes a calibration", () => {
  const report = { image: { width: 200, height: 200 }, calibration: { assumed_circle: { cx: 100, cy: 100, radius: 90 } } };
  const file = assumedFile("hall", report);
  assert.deepEqual([file.id, file.lens.model, file.lens.cx, file.image], ["hall", "equidistant", 99.5, report.image]);
  assert.ok(Math.abs(file.lens.focal * file.lens.max_theta - 90) < 1e-9);
});
