"""Tests of the training samples: quarter turns and cuts keep boxes exact."""

import math
import unittest

import numpy as np
from generator.boxes import axis_box

from samples import cut, frame_maps, kept, turned, view_rays


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


if __name__ == "__main__":
    unittest.main()
