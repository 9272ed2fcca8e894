"""Tests of the training samples: quarter turns and cuts keep boxes exact."""

import json
import math
import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np
from generator.boxes import axis_box
from samples import EmptyFrames, Mixed, cut, frame_maps, kept, outward_angles, turned, view_rays

LENS = {"model": "equidistant", "focal": 60.0, "cx": 99.5, "cy": 99.5, "max_theta": 1.5}


def write_empty_frame(folder, people=()):
    """A black frame with four white distractors of 10 × 10 pixels: above, below, left and right of the middle."""
    image, corners = np.zeros((200, 200, 3), np.uint8), ((95, 30), (95, 160), (30, 95), (160, 95))
    for x, y in corners:
        image[y : y + 10, x : x + 10] = 255
    for part in ("images", "calibrations"):
        (folder / part).mkdir()
    cv2.imwrite(str(folder / "images" / "7.png"), image)
    (folder / "calibrations" / "7.json").write_text(json.dumps({"lens": LENS}))
    about = {"id": 7, "file_name": "7.png", "calibration": "7", "width": 200, "height": 200}
    distractors = [{"image_id": 7, "kind": "coats", "bbox": [x, y, 10, 10]} for x, y in corners]
    data = {"images": [about], "annotations": list(people), "distractors": distractors}
    (folder / "annotations.json").write_text(json.dumps(data))


class Fixed:
    """A source whose samples are its name."""

    def __init__(self, name):
        self.name = name

    def sample(self, rng, size, tile_share, view_share):
        return self.name


class Samples(unittest.TestCase):
    def test_quarter_turns_keep_boxes_exact(self):
        image = np.zeros((60, 90), np.uint8)
        image[10:25, 40:70] = 1
        box = np.array([[40.0, 10, 70, 25]])
        for quarter in range(4):
            _, _, boxes, _ = turned(90, 60, box, np.zeros(1), quarter)
            x, y, w, h = axis_box(np.rot90(image, quarter))
            np.testing.assert_array_equal(boxes[0], [x, y, x + w, y + h])

    def test_quarter_turns_take_the_upright_angle_along(self):
        _, _, _, angles = turned(90, 60, np.zeros((1, 4)), [100.0], 1)
        self.assertAlmostEqual(angles[0], 10.0)

    def test_cut_moves_boxes_with_the_image(self):
        image = np.zeros((80, 80, 3), np.uint8)
        image[20:40, 30:50] = 255
        sample, boxes, _ = cut(image, np.array([[30.0, 20, 50, 40]]), np.zeros(1, bool), 10, 10, 2.0, 100)
        x, y, w, h = axis_box(sample[..., 0] > 127)
        np.testing.assert_allclose(boxes[0], [x, y, x + w, y + h], atol=1)

    def test_cut_ignores_what_is_mostly_outside(self):
        _, boxes, ignore = cut(
            np.zeros((80, 80, 3), np.uint8),
            np.array([[0.0, 0, 20, 20], [30, 30, 50, 50]]),
            np.zeros(2, bool),
            15,
            15,
            1.0,
            60,
        )
        self.assertEqual(list(ignore), [True, False])

    def test_a_view_looks_where_it_is_told(self):
        up = np.array([0, 0.6, -0.8])
        rays = view_rays(up, math.radians(50), 1.0, math.radians(90), 0.0, 101, 20)
        middle = rays[70, 70] / np.linalg.norm(rays[70, 70])
        self.assertAlmostEqual(math.degrees(math.acos(middle @ -up)), 50, places=9)
        right, left = rays[70, 120] - rays[70, 70], rays[70, 20] - rays[70, 70]
        self.assertAlmostEqual(np.linalg.norm(right), 100 / 101, places=9)
        np.testing.assert_allclose(right, -left, atol=1e-12)

    def test_up_in_a_view_is_up_in_the_world(self):
        up = np.array([0, 0.6, -0.8])
        rays = view_rays(up, math.radians(50), 1.0, math.radians(90), 0.0, 100, 0)
        rise = (rays / np.linalg.norm(rays, axis=-1, keepdims=True)) @ up
        self.assertTrue((np.diff(rise, axis=0) < 0).all())
        np.testing.assert_allclose(rise[:, 0], rise[:, -1], atol=1e-12)

    def test_rays_meet_the_pixels_of_the_lens(self):
        lens = {"model": "equidistant", "focal": 100.0, "cx": 200.0, "cy": 210.0, "max_theta": 1.5}
        rays = np.array([[[math.sin(0.5), 0, math.cos(0.5)], [0, math.sin(1.6), math.cos(1.6)]]])
        columns, rows = frame_maps(rays, lens)
        np.testing.assert_allclose([columns[0, 0], rows[0, 0]], [250, 210], atol=1e-4)
        self.assertLess(columns[0, 1], 0)

    def test_boxes_beyond_a_sample_are_clipped_ignored_or_dropped(self):
        boxes = np.array([[10.0, 10, 30, 30], [-15, 10, 5, 30], [-50, 0, -10, 20]])
        clipped, ignore = kept(boxes, np.zeros(3, bool), 100)
        np.testing.assert_array_equal(clipped, [[10, 10, 30, 30], [0, 10, 5, 30]])
        self.assertEqual(list(ignore), [False, True])

    def test_crops_of_empty_frames_lie_around_distractors(self):
        with tempfile.TemporaryDirectory() as folder:
            write_empty_frame(Path(folder))
            frames, rng = EmptyFrames(folder), np.random.default_rng(1)
            for _ in range(10):
                image, boxes, ignore = frames.sample(rng, 64, tile_share=0.0)
                self.assertGreater(image.max(), 100)
                self.assertEqual((len(boxes), len(ignore)), (0, 0))

    def test_crops_of_empty_frames_lie_around_false_alarms(self):
        with tempfile.TemporaryDirectory() as folder:
            write_empty_frame(Path(folder))
            found = Path(folder) / "found.json"
            found.write_text(json.dumps([{"image_id": 7, "bbox": [20, 90, 10, 20], "score": 0.4}]))
            boxes = EmptyFrames(folder, found).load(0)[1]
            self.assertEqual(len(boxes), 5)
            np.testing.assert_array_equal(boxes[-1], [20, 90, 30, 110])

    def test_frames_with_people_are_not_empty(self):
        with tempfile.TemporaryDirectory() as folder:
            write_empty_frame(Path(folder), people=[{"image_id": 7, "bbox": [0, 0, 9, 9]}])
            with self.assertRaisesRegex(SystemExit, "has people"):
                EmptyFrames(folder)

    def test_outward_angles_turn_clockwise_from_up(self):
        boxes = np.array([[40.0, 0, 60, 20], [80, 40, 100, 60], [0, 40, 20, 60]])
        np.testing.assert_allclose(outward_angles(boxes, 50, 50), [0, 90, -90])

    def test_mixed_samples_have_the_share_without_people(self):
        mixed, rng = Mixed(Fixed("people"), Fixed("empty"), 0.25), np.random.default_rng(1)
        drawn = [mixed.sample(rng, 64) for _ in range(400)]
        self.assertAlmostEqual(drawn.count("empty") / 400, 0.25, delta=0.07)


if __name__ == "__main__":
    unittest.main()
