"""Markdown tables."""

import unittest

from harness.figures import spread
from harness.tables import spread_cell, table


class Tables(unittest.TestCase):
    def test_words_stand_left_and_figures_right(self):
        self.assertEqual(table(("what", "ms"), [("a|b", 1.5)]), "| what | ms |\n|---|---:|\n| a\\|b | 1.50 |\n")

    def test_what_was_not_measured_is_a_dash(self):
        self.assertIn("| a | – |", table(("what", "ms"), [("a", None)]))

    def test_a_row_that_does_not_fit_is_refused(self):
        with self.assertRaisesRegex(ValueError, "3 cells under a head of 2"):
            table(("what", "ms"), [("a", 1, 2)])

    def test_a_spread_shows_its_range(self):
        self.assertEqual(spread_cell(spread([1.0, 2.0, 4.0]).as_json()), "2.00 (1.00 to 4.00)")


if __name__ == "__main__":
    unittest.main()
