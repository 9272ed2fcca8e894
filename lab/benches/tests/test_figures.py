"""Statistics over rounds."""

import unittest

from harness.figures import ratios, round_to, spread


class Figures(unittest.TestCase):
    def test_a_spread_is_the_median_with_its_range(self):
        found = spread([3.0, 1.0, 2.0, 9.0])
        self.assertEqual((found.median, found.least, found.greatest, found.count), (2.5, 1.0, 9.0, 4))

    def test_ratios_are_taken_round_by_round(self):
        # A machine at half speed in the second round changes no ratio.
        self.assertEqual(ratios([10.0, 5.0], [20.0, 10.0]), spread([0.5, 0.5]))

    def test_rounds_without_a_partner_are_refused(self):
        with self.assertRaises(ValueError):
            ratios([1.0, 2.0], [1.0])

    def test_numbers_keep_three_digits_and_no_false_ones(self):
        values = (0.012345, 0.5, 12.34, 1234.5, 0.0, float("nan"))
        self.assertEqual([round_to(value) for value in values], ["0.0123", "0.500", "12.3", "1234", "0", "–"])


if __name__ == "__main__":
    unittest.main()
