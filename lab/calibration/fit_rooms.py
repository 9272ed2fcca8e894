#!/usr/bin/env python3
"""Measure `lookdown calibration fit` on frames with true calibrations: `fit_rooms.py DATASET [--binary PATH] [--people]`.

DATASET is a folder of `tilted_rooms.py`, or of the generator of training frames: `--half` takes every second group of
four of its rooms.

Prints one line per camera, then median, 95 % quantile and greatest value of three errors: the radius at 20 to 80 degrees
in percent, the center in percent of the width, the level in degrees. Cameras that the program refuses are counted by
their reason, and those that are wrong by more than 5 % or 3 degrees. With `--people`, the height is found from the people
of the frames, and the places of the people on the floor are compared with the true ones, in percent of the distance.
"""

import argparse
import collections
import json
import math
import re
import resource
import subprocess
from itertools import groupby
from pathlib import Path

import numpy as np
from tilted_rooms import level, radius, rays

LIMITS = {"radius": 2.0, "center": 0.7, "level": 1.0}
WRONG = {"radius": 5.0, "level": 3.0}
#: Upper ends of the groups of tilts, degrees.
TILTS = [1, 5, 25, 36, 90]


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


def floor(calibration, height_m, people):
    """The places of people on the floor, meters."""
    down = -np.array(calibration["mount"]["world_up"])
    ray = rays(calibration["lens"], np.array([person["feet_px"] for person in people])) @ level(down).T
    return height_m * ray[:, :2] / ray[:, 2:]


def floor_errors(calibration, height_m, people):
    """Errors of the places in percent of the distance from the point below the camera."""
    true = np.array([person["floor_m"] for person in people])
    away = np.linalg.norm(true, axis=1)
    off = np.linalg.norm(floor(calibration, height_m, people) - true, axis=1)
    # A foot above the horizon of a wrong level is nowhere.
    off = np.nan_to_num(off, nan=np.inf)
    return [100 * error / far for error, far in zip(off, away, strict=True) if far > 0.5]


def run(binary, *arguments):
    """The calibration that the program prints, or the reason without its numbers, and the seconds of all threads."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [binary, "calibration", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode == 0:
        return json.loads(done.stdout), "", seconds
    said = done.stderr.strip().splitlines()[-1].rsplit("the rest: ", 1)[-1]
    return None, re.sub(r"[\d.]+", "N", said), seconds


def groups(image, true):
    """The groups that a camera belongs to."""
    tilt = math.degrees(math.acos(min(1.0, -true["mount"]["world_up"][2])))
    names = [f"tilt up to {next(end for end in TILTS if tilt <= end)}°"]
    names += [f"lens {true['lens']['model']}"]
    names += [f"degradation {image['degradation']}"] if "degradation" in image else []
    names += [f"look {image['look']['kind']}"] if "look" in image else []
    return names


def report_groups(counts):
    """One line for each group of cameras."""
    for name, count in sorted(counts.items()):
        reasons = {key: value for key, value in count.items() if key not in ("cameras", "fitted", "within", "wrong")}
        fitted, within, wrong = (count[key] for key in ("fitted", "within", "wrong"))
        print(f"{name}: {count['cameras']} cameras, {fitted} fitted, {within} within, {wrong} wrong, refused {reasons}")


def summary(name, values):
    """One line about a row of numbers."""
    if values:
        median, most, greatest = np.median(values), np.quantile(values, 0.95), max(values)
        print(f"{name}: {len(values)} values, median {median:.2f}, 95 % {most:.2f}, max {greatest:.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--binary", default="target/release/lookdown")
    parser.add_argument("--people", action="store_true", help="compare places on the floor")
    parser.add_argument("--half", type=int, choices=[0, 1], help="every second group of four rooms")
    parser.add_argument("--lens", action="store_true", help="give the true model of ideal lenses, leave others out")
    arguments = parser.parse_args()
    images = json.loads((arguments.dataset / "annotations.json").read_text())["images"]
    if arguments.half is not None:
        images = [image for image in images if image["room"] // 4 % 2 == arguments.half]
    counts = collections.defaultdict(collections.Counter)
    rows, refused, places = [], collections.Counter(), collections.defaultdict(list)
    for camera, group in groupby(images, lambda image: image["calibration"]):
        shots = list(group)
        frames = [str(arguments.dataset / "images" / image["file_name"]) for image in shots]
        true = json.loads((arguments.dataset / "calibrations" / f"{camera}.json").read_text())
        if arguments.lens and "focal" not in true["lens"]:
            continue
        given = ["--lens", true["lens"]["model"]] if arguments.lens else []
        names = groups(shots[0], true)
        found, reason, seconds = run(arguments.binary, "fit", *given, *frames)
        for name in names:
            counts[name]["cameras"] += 1
        if found is None:
            refused[reason] += 1
            for name in names:
                counts[name][" ".join(reason.split()[:6])] += 1
            print(f"{camera}: {reason}")
            continue
        row = errors(found, true)
        outside = any(row[name] > limit for name, limit in LIMITS.items())
        wrong = any(row[name] > limit for name, limit in WRONG.items())
        for name in names:
            counts[name].update(fitted=1, within=int(not outside), wrong=int(wrong))
        said = {name: source["uncertainty"] for name, source in found["sources"].items()}
        print(f"{camera}: {row} {said} {seconds:.2f} s{' OUTSIDE' if outside else ''}")
        rows.append(row | {"seconds": seconds / len(frames), "outside": outside, "wrong": wrong})
        if arguments.people and shots[0].get("people"):
            compare(places, arguments.binary, frames, found, true, shots[0]["people"])
    for name in [*LIMITS, "seconds"]:
        summary(name, [row[name] for row in rows])
    outside, wrong = (sum(row[kind] for row in rows) for kind in ("outside", "wrong"))
    print(f"{len(rows)} fitted, {len(rows) - outside} within {LIMITS}, {wrong} wrong by more than {WRONG}")
    print(f"{sum(refused.values())} refused: {dict(refused)}")
    report_groups(counts)
    for name, values in places.items():
        summary(name, values)


def compare(places, binary, frames, found, true, people):
    """Adds the errors on the floor of the calibrations that are compared."""
    height_m = true["mount"]["height_m"]
    circle, _, _ = run(binary, "fit", "--circle-only", *frames)
    if circle is not None:
        places["floor, circle and true height, %"] += floor_errors(circle, height_m, people)
    places["floor, fit and true height, %"] += floor_errors(found, height_m, people)
    measured, _, _ = run(binary, "fit", "--people", *frames)
    if measured is not None:
        guess = measured["mount"]["height_m"]
        places["height from people, %"].append(100 * abs(guess / height_m - 1))
        places["floor, fit and height from people, %"] += floor_errors(found, guess, people)


if __name__ == "__main__":
    main()
