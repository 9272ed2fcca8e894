"""The script of the fuzzers has every importer, and their seeds exist."""

import re
import unittest

from fuzz import IMPORTERS, ROOT, TARGETS, seeds, statistic


class Fuzz(unittest.TestCase):
    def test_every_format_has_its_importer_fuzzed(self):
        source = (ROOT / "crates/lookdown-calibration/src/formats/format.rs").read_text()
        variants = re.search(r"pub enum Format \{(.*?)\n\}", source, re.DOTALL)[1]
        formats = re.findall(r"^ +(\w+),$", variants, re.MULTILINE)
        fuzzed = re.findall(r"Format::(\w+)\),$", (ROOT / "lab/fuzz/src/importer.rs").read_text(), re.MULTILINE)
        self.assertEqual(sorted(formats), sorted(fuzzed))
        self.assertEqual(len(IMPORTERS), len(fuzzed))

    def test_every_target_has_seeds(self):
        for target in TARGETS:
            self.assertTrue(seeds(target), target)

    def test_the_last_statistic_counts_and_a_missing_one_is_0(self):
        output = "stat::peak_rss_mb:  1\nstat::peak_rss_mb:              37\n"
        self.assertEqual(statistic("peak_rss_mb", output), 37)
        self.assertEqual(statistic("number_of_executed_units", output), 0)


if __name__ == "__main__":
    unittest.main()
