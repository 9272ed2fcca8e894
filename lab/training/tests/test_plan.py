"""Tests of floor plans that are not rectangles. Standard library and numpy only."""

import math
import unittest

import numpy as np
from generator.plan import CLEAR, front, is_within, parts


class Plans(unittest.TestCase):
    def test_camera_stays_clear_of_all_parts(self):
        camera = (2.0, -1.0)
        for seed in range(200):
            for part in parts(np.random.default_rng(seed), 12.0, 9.0, camera):
                self.assertFalse(is_within(part, *camera, CLEAR))

    def test_most_rooms_have_a_part(self):
        counts = [len(parts(np.random.default_rng(seed), 12.0, 9.0, (0.0, 0.0))) for seed in range(200)]
        self.assertGreater(sum(count > 0 for count in counts), 190)

    def test_turned_block_holds_points_along_its_own_axes(self):
        block = (1.0, 0.0, 2.0, 0.5, 90.0)
        self.assertTrue(is_within(block, 1.0, 1.9))
        self.assertFalse(is_within(block, 2.9, 0.0))

    def test_front_of_a_slanted_wall_ends_at_the_walls(self):
        # A wall at 45 degrees through (3, 0), in a room of 8 by 8 meters: from (-1, -4) to (4, 1).
        depth = 10.0
        inward = (-math.sin(math.radians(45)), math.cos(math.radians(45)))
        block = (3.0 - inward[0] * depth, -inward[1] * depth, 50.0, depth, 45.0)
        x, y, long = front(block, 8.0, 8.0)
        self.assertAlmostEqual(x, 1.5)
        self.assertAlmostEqual(y, -1.5)
        self.assertAlmostEqual(long, 5 * math.sqrt(2))


if __name__ == "__main__":
    unittest.main()
