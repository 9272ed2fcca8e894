"""The unit files of the package."""

import unittest
from pathlib import Path

UNITS = sorted((Path(__file__).resolve().parents[2] / "packaging" / "debian").glob("*.service"))


class Units(unittest.TestCase):
    def test_each_unit_limits_its_memory(self):
        self.assertEqual(len(UNITS), 3)
        for unit in UNITS:
            self.assertIn("\nMemoryMax=", unit.read_text(encoding="utf-8"), unit.name)


if __name__ == "__main__":
    unittest.main()
