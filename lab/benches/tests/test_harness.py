"""The shared code: matched persons, statistics over rounds, Markdown tables, and the usage of processes."""

import os
import unittest

from harness.boxes import boxes, iou, matched
from harness.figures import ratios, round_to, spread, spread_cell, table
from harness.usage import usage_of

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


class Figures(unittest.TestCase):
    def test_a_spread_is_the_median_with_its_range(self):
        found = spread([3.0, 1.0, 2.0, 9.0])
        self.assertEqual((found.median, found.least, found.greatest), (2.5, 1.0, 9.0))

    def test_ratios_are_taken_round_by_round(self):
        # A machine at half speed in the second round changes no ratio.
        self.assertEqual(ratios([10.0, 5.0], [20.0, 10.0]), spread([0.5, 0.5]))

    def test_rounds_without_a_partner_are_refused(self):
        with self.assertRaises(ValueError):
            ratios([1.0, 2.0], [1.0])

    def test_numbers_keep_three_digits_and_no_false_ones(self):
        values = (0.012345, 0.5, 12.34, 1234.5, 0.0, float("nan"))
        self.assertEqual([round_to(value) for value in values], ["0.0123", "0.500", "12.3", "1234", "0", "–"])


class Tables(unittest.TestCase):
    def test_words_stand_left_and_figures_right(self):
        self.assertEqual(table(("what", "ms"), [("a|b", 1.5)]), "| what | ms |\n|---|---:|\n| a\\|b | 1.50 |\n")

    def test_what_was_not_measured_is_a_dash(self):
        self.assertIn("| a | – |", table(("what", "ms"), [("a", None)]))

    def test_a_row_that_does_not_fit_is_refused(self):
        with self.assertRaisesRegex(ValueError, "3 cells under a head of 2"):
            table(("what", "ms"), [("a", 1, 2)])

    def test_a_spread_shows_its_range(self):
        self.assertEqual(spread_cell(spread([1.0, 2.0, 4.0])), "2.00 (1.00 to 4.00)")


class UsageOfProcesses(unittest.TestCase):
    def test_work_shows_as_cpu_seconds(self):
        before = usage_of(os.getpid())
        while usage_of(os.getpid()).cpu_seconds < before.cpu_seconds + 0.02:
            sum(range(10_000))
        self.assertGreater(before.resident_bytes, 1 << 20)

    def test_a_process_that_has_ended_has_nothing(self):
        child = os.fork()
        if child == 0:
            os._exit(0)
        os.waitpid(child, 0)
        self.assertEqual(usage_of(child).resident_bytes, 0)
