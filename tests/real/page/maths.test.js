/** The calculations of the page. */

import assert from "node:assert/strict";
import test from "node:test";
import { corners, holds, roundStep } from "../../../web/geometry.js";
import { replacedIn } from "../../../web/calibration_sources.js";
import { valuesOf } from "../../../web/calibration_values.js";
import { assumedCircle, calibrationOf, circleOf, pixelOfFloor, rimOf, withFound } from "../../../web/lens.js";
import { hourOf } from "../../../web/camera_day.js";
import { countedNumbers, steps } from "../../../web/plot.js";
import { turned, zoomed } from "../../../web/live_view.js";
import { parseEvent } from "../../../web/server.js";
import { continued, straighten } from "../../../web/straighten.js";

const near = (one, other, tolerance = 1e-9) => assert.ok(Math.abs(one - other) <= tolerance, `${one} is not ${other}`);

test("an oriented box turns clockwise on the screen", () => {
  const upright = corners({ cx: 10, cy: 20, width: 4, height: 8, angle_deg: 0 });
  assert.deepEqual(upright, [[8, 16], [12, 16], [12, 24], [8, 24]]);
  // A quarter turn brings the top to the right.
  const [topLeft] = corners({ cx: 10, cy: 20, width: 4, height: 8, angle_deg: 90 });
  near(topLeft[0], 14);
  near(topLeft[1], 18);
});

test("an outline contains inner points, also when it is concave", () => {
  const bent = [[0, 0], [10, 0], [10, 10], [5, 3], [0, 10]];
  assert.ok(holds(bent, [5, 2]));
  assert.ok(!holds(bent, [5, 6]));
  assert.ok(!holds(bent, [11, 5]));
});

test("steps of axes are round", () => {
  assert.deepEqual([[6, 3], [4.9, 6], [0.5, 5], [70, 6]].map(([length, most]) => roundStep(length, most)), [2, 1, 0.1, 20]);
});

test("the circle of a found lens follows its polynomial", () => {
  const lens = { model: "kannala_brandt", fx: 200, fy: 200, cx: 319.5, cy: 239.5, k: [0.1, -0.02, 0, 0], max_theta: 1.5 };
  const { cx, cy, radius } = rimOf({ image: { width: 640, height: 480 }, lens });
  assert.deepEqual([cx, cy], [320, 240]);
  // 1.5 + 0.1 · 1.5³ - 0.02 · 1.5⁵ = 1.685625
  near(radius, 200 * 1.685625);
  assert.equal(rimOf({ image: { width: 640, height: 480 }, lens: { ...lens, fy: 190 } }), null);
});

test("places on the floor are seen where the server sees them", () => {
  const lens = { model: "equidistant", focal: 300, cx: 479.5, cy: 479.5, max_theta: 1.5 };
  // A camera at 3 m looks straight down, then it is tilted by 0.1 radians.
  const level = pixelOfFloor({ lens, mount: { world_up: [0, 0, -1], height_m: 3 } });
  assert.deepEqual(level([0, 0]), [480, 480]);
  near(level([3, 0])[0], 480 + (300 * Math.PI) / 4);
  near(level([0, -3])[1], 480 - (300 * Math.PI) / 4);
  assert.equal(level([1000, 0]), null);
  const tilted = pixelOfFloor({ lens, mount: { world_up: [0, Math.sin(0.1), -Math.cos(0.1)], height_m: 3 } });
  near(tilted([0, 0])[1], 480 - 30);
  near(tilted([0, 3 * Math.tan(0.3)])[1], 480 + 60);
  assert.equal(pixelOfFloor({ lens, mount: {} }), null);
});

test("a circle survives conversion to a lens and back", () => {
  for (const model of ["equidistant", "equisolid", "stereographic", "orthographic"]) {
    const circle = { width: 960, height: 720, model, cx: 481.5, cy: 360.25, radius: 350, fieldOfView: 170, cameraHeight: 2.8 };
    const file = calibrationOf({ id: "lobby", ...circle });
    assert.equal(file.lens.cx, 481);
    const back = circleOf(file);
    for (const [name, value] of Object.entries(circle)) {
      if (typeof value === "number") near(back[name], value, 1e-9);
      else assert.equal(back[name], value);
    }
  }
});

test("lenses without a circle are left unchanged", () => {
  const file = calibrationOf({ id: "lobby", width: 10, height: 10, model: "equidistant", cx: 5, cy: 5, radius: 5, fieldOfView: 180 });
  assert.equal(circleOf({ ...file, lens: { ...file.lens, model: "mei" } }), null);
  assert.equal(circleOf({ ...file, mount: { world_up: [0, -1, 0] } }), null);
});

test("a changed circle keeps the rest of its calibration", () => {
  const lens = { model: "equidistant", cx: 5, cy: 5, radius: 5, fieldOfView: 180, cameraHeight: 3 };
  const base = {
    ...calibrationOf({ id: "lobby", width: 10, height: 10, ...lens }),
    zones: [{ name: "a", frame_px: [[1, 1], [5, 1], [5, 5]] }, { name: "b", floor_m: [[1, 1], [2, 1], [2, 2]] }],
    detect: { profile: "fast" },
  };
  base.mount.site = "ground-floor";
  const file = calibrationOf({ id: "lobby", width: 20, height: 20, ...lens, cameraHeight: null }, base);
  assert.deepEqual(file.mount, { site: "ground-floor", world_up: [0, 0, -1] });
  assert.deepEqual(file.zones, [{ name: "a", frame_px: [[2, 2], [10, 2], [10, 10]] }, base.zones[1]].map(({ name, ...corners }) => ({ ...corners, name })));
  assert.deepEqual(file.detect, base.detect);
});

const CIRCLE = { id: "lobby", width: 10, height: 10, model: "equidistant", cx: 5, cy: 5, radius: 5, fieldOfView: 180, cameraHeight: 2.8 };
const GIVEN = { source: "given" };
const measured = (uncertainty) => ({ source: "measured", uncertainty });
const FROM_PEOPLE = { source: "from_people", uncertainty: 0.1 };

/** The file of the circle with these sources. */
const circleWith = (sources) => ({ ...calibrationOf(CIRCLE), sources });

/** An answer of the server with a found lens. */
const FOUND = {
  id: "lobby",
  image: { width: 10, height: 10 },
  lens: { model: "kannala_brandt", fx: 3, fy: 3, cx: 4.5, cy: 4.5, k: [0, 0, 0, 0], max_theta: Math.PI / 2 },
  mount: { world_up: [0, Math.sin(0.1), -Math.cos(0.1)], height_m: 2.6 },
  sources: { lens: measured(0.3), center: measured(0.5), world_up: measured(0.15), height_m: FROM_PEOPLE },
};

test("a drawn circle is given and looks straight down by assumption", () => {
  const base = circleWith({ lens: measured(0.3), lens_model: GIVEN, field_of_view: GIVEN, center: measured(0.5), world_up: measured(0.1), height_m: FROM_PEOPLE });
  const drawn = { lens: GIVEN, center: GIVEN, world_up: { source: "assumed" } };
  assert.deepEqual(calibrationOf({ ...CIRCLE, radius: 4 }, base).sources, { ...drawn, height_m: FROM_PEOPLE });
  assert.deepEqual(calibrationOf({ ...CIRCLE, cameraHeight: null }).sources, drawn);
  const tilted = { ...base, mount: FOUND.mount };
  assert.deepEqual(calibrationOf({ ...CIRCLE, cameraHeight: 2.6 }, tilted).sources, { ...drawn, height_m: FROM_PEOPLE });
});

test("a typed height is given, and the circle keeps its sources", () => {
  const base = circleWith({ lens: measured(0.3), center: measured(0.5), height_m: FROM_PEOPLE });
  const { height_m: _, ...ofLens } = base.sources;
  assert.deepEqual(calibrationOf(CIRCLE, base).sources, base.sources);
  const typed = calibrationOf({ ...CIRCLE, cameraHeight: 3.1 }, base);
  assert.deepEqual([typed.mount.height_m, typed.sources], [3.1, { ...ofLens, height_m: GIVEN }]);
  const emptied = calibrationOf({ ...CIRCLE, cameraHeight: null }, base);
  assert.deepEqual([emptied.mount.height_m, emptied.sources], [undefined, ofLens]);
});

test("a known height stays with its source when a lens is found", () => {
  const heightIn = ({ mount, sources }) => [mount.height_m, sources.height_m];
  const base = circleWith({ lens: GIVEN, height_m: GIVEN });
  assert.deepEqual(heightIn(withFound(base, FOUND)), [2.8, GIVEN]);
  assert.deepEqual(heightIn(withFound(circleWith({}), FOUND)), [2.8, undefined]);
  assert.deepEqual(heightIn(withFound(circleWith({ height_m: measured(0.02) }), FOUND, 2.8)), [2.8, measured(0.02)]);
  assert.deepEqual(heightIn(withFound(base, FOUND, 3.1)), [3.1, GIVEN]);
  assert.deepEqual(heightIn(withFound(null, FOUND, 3.1)), [3.1, GIVEN]);
  assert.deepEqual(heightIn(withFound(null, FOUND)), [2.6, FROM_PEOPLE]);
});

test("a found lens brings its sources instead of those before", () => {
  const base = circleWith({ lens: GIVEN, lens_model: GIVEN, field_of_view: GIVEN, world_up: GIVEN });
  const { height_m: _, ...ofLens } = FOUND.sources;
  assert.deepEqual(withFound(base, FOUND).sources, ofLens);
});

test("what a found lens replaces is named, unless it was assumed", () => {
  const base = circleWith({ lens: measured(0.3), lens_model: GIVEN, center: GIVEN, world_up: { source: "assumed" }, height_m: GIVEN });
  assert.deepEqual(replacedIn(base), ["Replaces the measured lens.", "Replaces the given lens model.", "Replaces the given center."]);
  assert.deepEqual(replacedIn(circleWith(undefined)), ["Replaces the saved lens."]);
  assert.deepEqual(replacedIn(undefined), []);
});

/** The rows of a file: `title | value ± deviation | source`. */
const rowsOf = (file) => valuesOf(file).map(({ title, value, spread, source }) => [title, [value, spread].filter(Boolean).join(" "), source].filter(Boolean).join(" | "));

test("values are shown with their standard deviation and source", () => {
  assert.deepEqual(rowsOf(FOUND), [
    "Lens | kannala_brandt | measured",
    "Field of view | 180.0° | measured",
    "Radius | ± 0.30 % | measured",
    "Center | 5.0, 5.0 ± 0.5 px | measured",
    "Tilt | 5.7° ± 0.15° | measured",
    "Height | 2.60 m ± 0.10 m | from people",
  ]);
  const known = { lens: measured(0.3), lens_model: GIVEN, field_of_view: GIVEN, world_up: { source: "assumed" } };
  assert.deepEqual(rowsOf(circleWith(known)), [
    "Lens | equidistant | given",
    "Field of view | 180.0° | given",
    "Radius | ± 0.30 % | measured",
    "Center | 5.0, 5.0",
    "Tilt | 0.0° | assumed",
    "Height | 2.80 m",
  ]);
});

test("a file without sources or optional values shows what it has", () => {
  const { sources: _, mount: __, ...bare } = FOUND;
  const { max_theta: ___, ...lens } = bare.lens;
  assert.deepEqual(rowsOf({ ...bare, lens }), ["Lens | kannala_brandt", "Center | 5.0, 5.0"]);
  assert.deepEqual(rowsOf({ ...bare, lens, sources: { lens: { source: "new" } } }), ["Lens | kannala_brandt", "Center | 5.0, 5.0"]);
});

test("without a detected circle the largest one that fits is used", () => {
  const { cx, cy, radius } = assumedCircle({ image: { width: 800, height: 600 } });
  assert.deepEqual([cx, cy, radius], [400, 300, 300]);
});

test("the assumed circle of a report is used", () => {
  const assumed_circle = { cx: 401.5, cy: 299, radius: 280.25 };
  const { cx, cy, radius } = assumedCircle({ image: { width: 800, height: 600 }, calibration: { assumed_circle } });
  assert.deepEqual({ cx, cy, radius }, assumed_circle);
});

test("straightening with an identity grid gives the frame", () => {
  const [side, cells] = [8, 4];
  const data = Uint8ClampedArray.from({ length: 4 * side * side }, (_, index) => (index % 4 === 3 ? 255 : (index * 7) % 251));
  const pixels = { width: side, height: side, data };
  const grid = Array.from({ length: (cells + 1) ** 2 }, (_, node) => [(node % (cells + 1)) * 2, Math.floor(node / (cells + 1)) * 2]);
  const target = { width: side, height: side, data: new Uint8ClampedArray(data.length) };
  straighten(pixels, side, grid, cells, target);
  assert.deepEqual(target.data, data);
  // The plan may have been made for frames of another size.
  const doubled = grid.map((place) => place.map((value) => value * 2));
  straighten(pixels, side * 2, doubled, cells, target);
  assert.deepEqual(target.data, data);
});

test("a grid is extrapolated linearly beyond the lens image", () => {
  const grid = Array.from({ length: 25 }, (_, node) => (node % 5 < 3 ? [node % 5, Math.floor(node / 5)] : null));
  const places = continued(grid, 4);
  assert.deepEqual(places[4], [4, 0]);
  assert.deepEqual(places[23], [3, 4]);
  assert.ok(Number.isNaN(continued(Array(25).fill(null), 4)[0][0]));
});

test("a count holds until the next", () => {
  const path = steps([{ time: 0, persons: 2 }, { time: 5, persons: 4 }], (time) => time, (persons) => -persons);
  assert.equal(path, "M0.0 -2.0H5.0V-4.0");
});

test("events are read as they are sent", () => {
  assert.deepEqual(parseEvent('id: 17\ndata: {"a": 1}'), { id: "17", data: '{"a": 1}' });
  assert.deepEqual(parseEvent(": nothing new"), { id: "", data: "" });
  assert.deepEqual(parseEvent("data: one\ndata: two"), { id: "", data: "one\ntwo" });
});

test("a time without a number is a gap of the plot, one with too few frames is marked", () => {
  const counted = [
    { from: "1970-01-01T00:00:00Z", persons: { mean: 1.6, max: 3 } },
    { from: "1970-01-01T00:01:00Z", persons: { mean: 2.1, max: 3 } },
    { from: "1970-01-01T00:02:00Z", persons: null },
    { from: "1970-01-01T00:03:00Z", persons: { mean: 1, max: 1 }, slow_seconds: 0 },
    { from: "1970-01-01T00:04:00Z", persons: { mean: 1, max: 1 }, slow_seconds: 30 },
  ];
  const history = countedNumbers(counted);
  assert.deepEqual(history, [
    { time: 0, persons: 2, slow: false },
    { time: 120_000, persons: null, slow: false },
    { time: 180_000, persons: 1, slow: false },
    { time: 240_000, persons: 1, slow: true },
  ]);
  const path = steps(history, (time) => time / 60_000, (persons) => persons);
  assert.equal(path, "M0.0 2.0H2.0M3.0 1.0H4.0V1.0");
});

test("a dragged view turns with the pointer, and a panorama keeps its height", () => {
  const view = { kind: "fixed", azimuth_deg: 10, tilt_deg: 45, field_of_view_deg: 80 };
  assert.deepEqual(turned(view, 0.25, 0.1), { ...view, azimuth_deg: 350, tilt_deg: 53 });
  assert.equal(turned(view, 0, 1).tilt_deg, 90);
  assert.deepEqual(turned({ kind: "panorama", azimuth_deg: 0 }, 0.5, 1), { kind: "panorama", azimuth_deg: 180 });
  near(zoomed(view, 1).field_of_view_deg, 80 / 1.1);
  assert.equal(zoomed(view, -20).field_of_view_deg, 150);
});

test("hours of a day of 25 are those of the clock, at most 24", () => {
  const zone = process.env.TZ;
  process.env.TZ = "Europe/Berlin";
  try {
    const midnight = Date.parse("2026-10-25T00:00:00+02:00");
    const hours = Array.from({ length: 25 }, (_, hour) => hourOf(midnight + hour * 3_600_000, midnight));
    assert.deepEqual(hours, [0, 1, 2, 2, ...Array.from({ length: 21 }, (_, hour) => hour + 3)]);
    const elsewhere = Date.parse("2026-10-25T00:00:00+09:00");
    assert.equal(hourOf(elsewhere + 24.5 * 3_600_000, elsewhere), 23);
  } finally {
    if (zone === undefined) delete process.env.TZ;
    else process.env.TZ = zone;
  }
});
