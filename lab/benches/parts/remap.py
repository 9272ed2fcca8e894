"""Rendering of views compared with OpenCV, by `against_opencv.py`."""

import json
import subprocess
import sys

from harness.effort import Effort
from harness.figures import table
from harness.places import BENCHES
from harness.processes import BenchError


def measure(effort: Effort) -> list[dict]:
    """Measures both sides alternately, a row per view size."""
    command = [sys.executable, str(BENCHES / "against_opencv.py"), str(12 * effort.rounds)]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    if answer.returncode != 0:
        raise BenchError(f"against_opencv.py failed: {answer.stderr.strip()}")
    return [json.loads(line) for line in answer.stdout.splitlines()]


def tell(raw: list[dict]) -> str:
    """The comparison as Markdown."""
    rows = [
        (row["view"], row["rounds"], row["ours_us"], row["opencv_us"], row["of_it_remap_us"], f"**{row['ratio']:.2f}**")
        for row in raw
    ]
    head = ("view", "rounds", "ours, µs", "remap + blobFromImages, µs", "of it remap, µs", "ratio, median")
    return f"One view, one thread, OpenCV {raw[0]['opencv']}:\n\n{table(head, rows)}"
