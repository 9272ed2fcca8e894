"""Runs the tests against real software: `run.py [PART...]`, where `PART` is a `test_PART.py` in this folder.

Each test starts the binary of the profile that the variable `PROFILE` names (default: release) and the other software,
uses them like a user, and stops them. Exits with 1 if a test fails. All parts are run by default. Most parts wait most of the time, so
several parts run at the same time, each in its own process; those of `ALONE` run after them.
"""

import concurrent.futures
import os
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
ALONE = ("walks", "replicas", "number", "count", "views", "camera_hashing", "deb")
"""Parts whose frames must be on time, and one that packs the files of the image."""
LONGEST = "page"
"""It starts first, so that the others run beside it."""
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
    if len(parts) == 1:
        return 0 if passes(parts[0]) else 1
    wanted = sorted(parts or there, key=lambda part: part != LONGEST)
    with concurrent.futures.ThreadPoolExecutor(1 + (os.cpu_count() or 1)) as pool:
        together = {pool.submit(run_process, part, subprocess.PIPE): part for part in wanted if part not in ALONE}
        failed = []
        for done in concurrent.futures.as_completed(together):
            process = done.result()
            print(f"== {together[done]}", process.stdout, sep="\n", flush=True)
            failed += [together[done]] if process.returncode else []
    failed += [part for part in ALONE if part in wanted and run_process(part, None).returncode]
    print(f"real: failed: {', '.join(failed)}" if failed else f"real: all {len(wanted)} parts passed")
    return 1 if failed else 0


def run_process(part: str, output: int | None) -> subprocess.CompletedProcess[str]:
    """Runs one part in its own process."""
    return subprocess.run(
        [sys.executable, __file__, part], stdout=output, stderr=output and subprocess.STDOUT, text=True, check=False
    )


def passes(part: str) -> bool:
    """Runs the tests of a part in this process."""
    tests = unittest.defaultTestLoader.loadTestsFromName(f"test_{part}")
    result = unittest.TextTestRunner(verbosity=2, resultclass=TimedResult).run(tests)
    return result.wasSuccessful() and result.testsRun > 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
