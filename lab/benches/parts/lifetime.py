"""The time from start to ready, and memory under steady load."""

import subprocess
import tempfile
import time
from pathlib import Path

from harness.charts import lines
from harness.effort import Effort
from harness.figures import growth, spread
from harness.frames import cameras, frame
from harness.load import load, start_load
from harness.lookdown import detect, lookdown, report
from harness.tables import spread_cell, table

PROFILE = "balanced"
CAMERAS = 100
LOAD_PERCENT = 80
SAMPLES = 60


def measure(effort: Effort) -> dict:
    """Measures starts with many calibrations, then a long steady load."""
    return {"starts": starts(effort), "memory": memory(effort)}


def starts(effort: Effort) -> list[dict]:
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


def memory(effort: Effort) -> dict:
    """Resident memory at regular intervals under an open loop."""
    paths, samples = [detect(PROFILE)], []
    seconds = effort.memory_minutes * 60
    with lookdown() as server:
        report(server, paths[0], frame())
        capacity = load(server, paths, frame(), clients=4, seconds=effort.seconds)["succeeded_per_second"]
        began = time.monotonic()
        loading = start_load(server, paths, frame(), seconds=seconds, rate=capacity * LOAD_PERCENT / 100)
        while loading.poll() is None:
            samples.append((time.monotonic() - began, server.usage().resident_bytes / 2**20))
            try:
                loading.communicate(timeout=seconds / SAMPLES)
            except subprocess.TimeoutExpired:
                continue
    return {"minutes": effort.memory_minutes, "samples": samples}


def tell(raw: dict) -> str:
    """Both as Markdown."""
    taken = raw["memory"]["samples"]
    resident = [mib for _, mib in taken]
    rows = [
        (f"start to ready, {CAMERAS} calibrations, s", cell([start["ready"] for start in raw["starts"]])),
        ("first frame of a camera, s", cell([start["first_frame"] for start in raw["starts"]])),
        (f"resident memory over {raw['memory']['minutes']:g} min at {LOAD_PERCENT} % load, MiB", cell(resident)),
        ("its growth from the second to the last quarter, MiB", round(growth(resident), 1)),
    ]
    return f"`{PROFILE}`:\n\n" + table(("", "median (range)"), rows)


def cell(values: list[float]) -> str:
    """A median with its range."""
    return spread_cell(spread(values).as_json())


def draw(raw: dict) -> str:
    """Memory over time as a chart."""
    points = [(seconds / 60, mib) for seconds, mib in raw["memory"]["samples"]]
    labels = ("minutes", "resident memory, MiB")
    return lines("memory", f"Memory at {LOAD_PERCENT} % load, {PROFILE}", labels, {PROFILE: points})
