"""Measures all of a frame but the network: decoding, rendering, merging, HTTP.

`host_side.py [SECONDS]`, after `scripts/setup.py benches` and `cargo build --release -p lookdown -p lookdown-load`.
The network costs nothing: it reads one value of each view and returns constant boxes, none or some. With boxes, the second pass has crops. The default models are measured for comparison. A frame's CPU time is that of
the server's process in a closed loop; the rate of 16 cores is extrapolated from it. Prints JSON, one line per network
and profile.
"""

import json
import os
import sys

from harness.frames import frame
from harness.free_network import free_network
from harness.load import steady
from harness.lookdown import ROOMY, detect, lookdown, report
from parts.whole import stages_of

PROFILES = ("fast", "balanced")
BOXES = (None, 0, 4, 16, 100)
"""The boxes that the network returns for each view; none for the default models."""
CORES = len(os.sched_getaffinity(0))
MANY_CORES = 16
FRAMES = 30


def main(seconds: float) -> None:
    for boxes in BOXES:
        network = {} if boxes is None else {"MODEL__PATH": str(free_network(boxes))}
        with lookdown(ROOMY | network) as server:
            for profile in PROFILES:
                path, jpeg = detect(profile), frame()
                stages = stages_of(server, path, FRAMES)
                answer = report(server, path, jpeg)
                loop = steady(
                    server, [path], jpeg, clients=2 * CORES, seconds=seconds, frame_seconds=stages["total"] / 1000
                )
                cpu_ms = loop["cpu_seconds_per_frame"] * 1000
                line = {
                    "profile": profile,
                    "network": "default" if boxes is None else f"{boxes} boxes per view",
                    "views": answer["views"],
                    "persons": len(answer["persons"]),
                    "stages_ms": {name: round(value, 2) for name, value in stages.items()},
                    "cores": CORES,
                    "cores_used": round(loop["cores"], 2),
                    "frames_per_second": round(loop["succeeded_per_second"], 1),
                    "cpu_ms_per_frame": round(cpu_ms, 1),
                    f"frames_per_second_of_{MANY_CORES}_cores": round(MANY_CORES * 1000 / cpu_ms),
                }
                print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
