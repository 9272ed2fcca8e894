"""The latency and memory of a camera on a server that has used many other cameras."""

import tempfile
from pathlib import Path

from harness.effort import Effort
from harness.figures import ratios, round_to, spread, spread_cell, table
from harness.frames import cameras, frame
from harness.load import load
from harness.lookdown import ROOMY, detect, lookdown, report

PROFILE = "fast"


def measure(effort: Effort) -> dict:
    """Alternates two servers: one with a single camera, and one with many."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (only,) = cameras(folder, 1)
        with lookdown(ROOMY, folder) as alone:
            report(alone, detect(PROFILE, only), frame())
            counts = [count for count in effort.cameras if count > 1]
            return {"cameras": [beside(effort, alone, only, count) for count in counts]}


def beside(effort: Effort, alone, only: str, count: int) -> dict:
    """Medians of windows: the camera alone, the camera among `count` used ones, and all of those in turns."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ids = cameras(folder, count)
        with lookdown(ROOMY, folder) as crowded:
            empty = crowded.usage().resident_bytes
            for camera in ids:
                report(crowded, detect(PROFILE, camera), frame())
            used = crowded.usage().resident_bytes
            result = {"alone": [], "among": [], "turns": []}
            for _ in range(effort.rounds):
                for key, server, asked in (
                    ("alone", alone, [only]),
                    ("among", crowded, ids[-1:]),
                    ("turns", crowded, ids),
                ):
                    paths = [detect(PROFILE, camera) for camera in asked]
                    late = load(server, paths, frame(), seconds=effort.seconds / 4)["succeeded"]
                    result[key].append(late["p50_ms"])
    return {"count": count, "mib": (used - empty) / 2**20, "mib_in_all": used / 2**20, **result}


def tell(raw: dict) -> str:
    """The table as Markdown."""
    return f"One client, `{PROFILE}`, medians; memory of the server, and from before the first frame:\n\n" + table(
        (
            "cameras",
            "memory, MiB",
            "of it cameras",
            "one alone, ms",
            "one among them ÷ alone",
            "all in turns ÷ one alone",
        ),
        [
            (
                row["count"],
                round_to(row["mib_in_all"]),
                round_to(row["mib"]),
                round_to(spread(row["alone"]).median),
                spread_cell(ratios(row["among"], row["alone"])),
                spread_cell(ratios(row["turns"], row["alone"])),
            )
            for row in raw["cameras"]
        ],
    )
