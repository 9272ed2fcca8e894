"""Runs the tests against real software: `run.py [PART...]`, where `PART` is a `test_PART.py` in this folder.

Each test starts the release binary, or the one that `LOOKDOWN_BINARY` names, and the other software, uses them like a user, and stops them. Exits with
1 if a test fails. All parts are run by default.
"""

import signal
import sys
import time
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE.parent / "reliability", HERE.parents[1] / "lab/benches"):
    sys.path.insert(0, str(folder))


class TimedResult(unittest.TextTestResult):
    """Prints the seconds of each test after its outcome."""

    def startTest(self, test: unittest.TestCase) -> None:
        self._started = time.monotonic()
        super().startTest(test)

    def stopTest(self, test: unittest.TestCase) -> None:
        self.stream.writeln(f"  {time.monotonic() - self._started:.1f} s")
        super().stopTest(test)


def main(parts: list[str]) -> int:
    """Returns the exit status."""
    there = sorted(file.stem.removeprefix("test_") for file in HERE.glob("test_*.py"))
    unknown = [part for part in parts if part not in there]
    if unknown:
        print(f"There is no part '{unknown[0]}'; the parts are {', '.join(there)}.", file=sys.stderr)
        return 2
    # Started servers are stopped on exit.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    tests = unittest.defaultTestLoader.loadTestsFromNames([f"test_{part}" for part in parts or there])
    result = unittest.TextTestRunner(verbosity=2, resultclass=TimedResult).run(tests)
    return 0 if result.wasSuccessful() and result.testsRun else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
