"""Matching the persons of two servers."""

import unittest

from harness.boxes import boxes, iou, matched

HERE, THERE, NEARBY = [0.0, 0.0, 10.0, 10.0], [50.0, 0.0, 60.0, 10.0], [0.0, 0.0, 10.0, 8.0]


class Agreement(unittest.TestCase):
    def test_boxes_that_do_not_touch_share_nothing(self):
        self.assertEqual(iou(HERE, THERE), 0.0)

    def test_a_box_is_in_one_pair_only_the_best(self):
        self.assertEqual(matched([HERE], [NEARBY, HERE, THERE]), [1.0])
        self.assertEqual(matched([HERE, NEARBY], [HERE]), [1.0])

    def test_boxes_are_read_from_an_answer(self):
        box = dict(zip(("x_min", "y_min", "x_max", "y_max"), HERE, strict=True))
        self.assertEqual(boxes({"persons": [{"box": box, "score": 0.5}]}), [HERE])


if __name__ == "__main__":
    unittest.main()
