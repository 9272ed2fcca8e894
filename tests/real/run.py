"""Runs the tests against real parts: `run.py [PART...]`, where `PART` is a `test_PART.py` beside this file; all by default.

Each starts the release binary and the part itself, talks to them as a user would, and stops them again. Exits with
1 when a test fails.
"""

import signal
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE.parent / "reliability", HERE.parents[1] / "benches"):
    sys.path.insert(0, str(folder))


def main(parts: list[str]) -> int:
    """The exit status."""
    there = sorted(file.stem.removeprefix("test_") for file in HERE.glob("test_*.py"))
    unknown = [part for part in parts if part not in there]
    if unknown:
        print(f"There is no part '{unknown[0]}'; the parts are {', '.join(there)}.", file=sys.stderr)
        return 2
    # Servers that were started are stopped on the way out.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    tests = unittest.defaultTestLoader.loadTestsFromNames([f"test_{part}" for part in parts or there])
    result = unittest.TextTestRunner(verbosity=2).run(tests)
    return 0 if result.wasSuccessful() and result.testsRun else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
