#!/usr/bin/env python3
"""Measure `lookdown calibration fit` on frames with true calibrations: `fit_rooms.py DATASET [--binary PATH]`.

Prints one line per frame, then median, 95 % quantile and greatest value of three errors: the radius at 20 to 80 degrees
in percent, the center in percent of the width, the level in degrees. Frames that the program refuses are counted.
"""

import argparse
import json
import math
import resource
import subprocess
from pathlib import Path

import numpy as np
from tilted_rooms import radius

LIMITS = {"radius": 2.0, "center": 0.7, "level": 1.0}


def errors(found, true):
    """The errors of a calibration."""
    angles = np.radians(np.arange(20, 81, 10))
    angles = angles[angles < true["lens"]["max_theta"]]
    ratio = radius(found["lens"], angles) / radius(true["lens"], angles)
    center = math.hypot(*(found["lens"][axis] - true["lens"][axis] for axis in ("cx", "cy")))
    cosine = np.dot(found["mount"]["world_up"], true["mount"]["world_up"])
    return {
        "radius": 100 * float(np.abs(ratio - 1).max()),
        "center": 100 * center / true["image"]["width"],
        "level": math.degrees(math.acos(min(1.0, float(cosine)))),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--binary", default="target/release/lookdown")
    arguments = parser.parse_args()
    images = json.loads((arguments.dataset / "annotations.json").read_text())["images"]
    rows, refused = [], 0
    for image in images:
        frame = arguments.dataset / "images" / image["file_name"]
        command = [arguments.binary, "calibration", "fit", str(frame)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        if done.returncode:
            refused += 1
            print(f"{frame.name}: {done.stderr.strip().splitlines()[-1]}")
            continue
        true = json.loads((arguments.dataset / "calibrations" / f"{image['calibration']}.json").read_text())
        row = errors(json.loads(done.stdout), true)
        outside = any(row[name] > limit for name, limit in LIMITS.items())
        print(f"{frame.name}: {row} {seconds:.2f} s{' OUTSIDE' if outside else ''}")
        rows.append(row | {"seconds": seconds})
    for name in [*LIMITS, "seconds"]:
        values = [row[name] for row in rows]
        if values:
            print(f"{name}: median {np.median(values):.2f}, 95 % {np.quantile(values, 0.95):.2f}, max {max(values):.2f}")
    print(f"{len(rows)} fitted, {refused} refused")


if __name__ == "__main__":
    main()
