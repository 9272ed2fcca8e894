"""Tests of the training samples: quarter turns and cuts keep boxes exact."""

import unittest

import numpy as np
from generator.boxes import axis_box

from samples import cut, turned


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


if __name__ == "__main__":
    unittest.main()
