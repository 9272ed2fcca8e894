"""Tests of the training samples: views look where they are told, and boxes stay exact."""

import json
import math
import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np
from samples import LYING, EmptyFrames, Frames, Mixed, frame_maps, kept, ray_at, view_rays

LENS = {"model": "equidistant", "focal": 60.0, "cx": 99.5, "cy": 99.5, "max_theta": 1.5}


def write_frame(folder, people=()):
    """A black frame with four white things of 10 × 10 pixels: above, below, left and right of the middle."""
    image, corners = np.zeros((200, 200, 3), np.uint8), ((95, 30), (95, 160), (30, 95), (160, 95))
    for x, y in corners:
        image[y : y + 10, x : x + 10] = 255
    for part in ("images", "calibrations", "ids"):
        (folder / part).mkdir()
    cv2.imwrite(str(folder / "images" / "7.png"), image)
    (folder / "calibrations" / "7.json").write_text(json.dumps({"lens": LENS, "mount": {"world_up": [0, 0, -1]}}))
    cv2.imwrite(str(folder / "ids" / "7.png"), (image[..., 0] // 255) * (np.arange(200) < 60)[:, None])
    about = {"id": 7, "file_name": "7.png", "calibration": "7", "id_mask": "ids/7.png", "width": 200, "height": 200}
    distractors = [{"image_id": 7, "kind": "coats", "bbox": [x, y, 10, 10]} for x, y in corners]
    data = {"images": [about], "annotations": list(people), "distractors": distractors}
    (folder / "annotations.json").write_text(json.dumps(data))


class Fixed:
    """A source whose samples are its name."""

    def __init__(self, name):
        self.name = name

    def sample(self, rng, size, *how):
        return self.name


class Samples(unittest.TestCase):
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
        clipped, ignore, keep = kept(boxes, np.zeros(3, bool), 100)
        np.testing.assert_array_equal(clipped, [[10, 10, 30, 30], [0, 10, 5, 30]])
        self.assertEqual((list(ignore), list(keep)), ([False, True], [True, True, False]))

    def test_the_ray_of_a_pixel_meets_the_pixel(self):
        columns, rows = frame_maps(ray_at(LENS, 130.0, 60.0)[None, None], LENS)
        np.testing.assert_allclose([columns[0, 0], rows[0, 0]], [130, 60], atol=0.01)

    def test_crops_of_empty_frames_lie_around_distractors(self):
        with tempfile.TemporaryDirectory() as folder:
            write_frame(Path(folder))
            frames, rng = EmptyFrames(folder), np.random.default_rng(1)
            for _ in range(10):
                image, boxes, ignore, posture = frames.sample(rng, 64, crops=1.0)
                self.assertGreater(image.max(), 100)
                self.assertEqual((len(boxes), len(ignore), len(posture)), (0, 0, 0))

    def test_views_of_empty_frames_may_look_at_distractors(self):
        with tempfile.TemporaryDirectory() as folder:
            write_frame(Path(folder))
            self.assertEqual(len(EmptyFrames(folder).places(0, None, False)), 4)

    def test_a_crop_shows_a_person_with_the_posture(self):
        person = {
            "image_id": 7,
            "bbox": [95, 30, 10, 10],
            "ignore": False,
            "id_value": 1,
            "pose": "on_back",
            "nadir_deg": 40,
        }
        with tempfile.TemporaryDirectory() as folder:
            write_frame(Path(folder), people=[person])
            frames, rng = Frames(folder), np.random.default_rng(1)
            for _ in range(10):
                image, boxes, ignore, posture = frames.sample(rng, 64, crops=1.0, floor=True)
                self.assertEqual(list(posture), [LYING])
                x, y = (boxes[0, :2] + boxes[0, 2:]).astype(int) // 2
                self.assertGreater(image[y, x].min(), 100)

    def test_frames_with_people_are_not_empty(self):
        with tempfile.TemporaryDirectory() as folder:
            write_frame(Path(folder), people=[{"image_id": 7, "bbox": [0, 0, 9, 9]}])
            with self.assertRaisesRegex(SystemExit, "has people"):
                EmptyFrames(folder)

    def test_mixed_samples_have_the_share_without_people(self):
        mixed, rng = Mixed(Fixed("people"), Fixed("empty"), 0.25), np.random.default_rng(1)
        drawn = [mixed.sample(rng, 64) for _ in range(400)]
        self.assertAlmostEqual(drawn.count("empty") / 400, 0.25, delta=0.07)


if __name__ == "__main__":
    unittest.main()
