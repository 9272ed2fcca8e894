"""The time from start to ready."""

import tempfile
import time
from pathlib import Path

from harness.effort import Effort
from harness.figures import spread, spread_cell, table
from harness.frames import cameras, frame
from harness.lookdown import detect, lookdown, report

PROFILE = "balanced"
CAMERAS = 100


def measure(effort: Effort) -> list[dict]:
    """Seconds to ready and of the first frame of a camera, which builds its remap tables."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        camera = cameras(folder, CAMERAS)[0]
        for _ in range(effort.starts):
            with lookdown(calibrations=folder) as server:
                began = time.monotonic()
                report(server, detect(PROFILE, camera), frame())
                rows.append({"ready": server.seconds_to_ready, "first_frame": time.monotonic() - began})
    return rows


def tell(raw: list[dict]) -> str:
    """Both as Markdown."""
    rows = [
        (f"start to ready, {CAMERAS} calibrations, s", spread_cell(spread([start["ready"] for start in raw]))),
        ("first frame of a camera, s", spread_cell(spread([start["first_frame"] for start in raw]))),
    ]
    return f"`{PROFILE}`:\n\n" + table(("", "median (range)"), rows)
