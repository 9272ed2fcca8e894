#!/usr/bin/env python3
"""Measure the places of people on the floor with nothing given but frames: `floor_places.py DATASET [--binary PATH]`.

DATASET is a folder of `lab/training/fixed_cameras.py`: many frames of each camera. Each camera is fitted from 1 and from 5
of its frames, and its height is found from the people that are detected in all frames. The places of the true feet are
compared with the true ones, in percent of the distance from the point below the camera, of people who are more than 0.5 m
away. The state before is the circle of the first frame, 180 degrees and a
camera that looks straight down, with the true height. Prints one line per camera, then median, 95 % and greatest value.
"""

import argparse
import collections
import json
import math
import tempfile
from itertools import groupby
from pathlib import Path

import numpy as np
from fit_rooms import errors, floor, floor_errors, run, summary

FRAMES = (1, 5)


def height_of(binary, calibration, frames, profile):
    """The height from the people of the frames, or the reason why there is none."""
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        mount = {name: value for name, value in calibration["mount"].items() if name != "height_m"}
        sources = {name: value for name, value in calibration.get("sources", {}).items() if name != "height_m"}
        json.dump(calibration | {"mount": mount, "sources": sources}, file)
        file.flush()
        found, reason, _ = run(binary, "height", file.name, *frames, "--set", f"detect.profile={profile}")
    return (found["mount"]["height_m"], found["sources"]["height_m"]["uncertainty"]) if found else (None, reason)


def add(places, name, calibration, height_m, people):
    """Adds the errors on the floor, and returns their median as text."""
    places[f"floor, {name}, %"] += (off := floor_errors(calibration, height_m, people))
    return f"floor {np.median(off):.2f} %" if off else ""


def from_people(places, name, binary, calibration, frames, true_m, people, profile):
    """Adds the errors of the height from people and of the places with it, and returns them as text."""
    height_m, deviation = height_of(binary, calibration, frames, profile)
    if height_m is None:
        places[f"{name}: height refused"].append(deviation)
        return f"height: {deviation}"
    off = 100 * (height_m / true_m - 1)
    places[f"{name}: error of the height, %"].append(abs(off))
    places[f"{name}: error of the height in deviations"].append(abs(height_m - true_m) / deviation)
    return f"{height_m:.2f} m ({off:+.1f} %), {add(places, f'{name} and height from people', calibration, height_m, people)}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--binary", default="target/release/lookdown")
    parser.add_argument("--profile", default="fast")
    arguments = parser.parse_args()
    binary, places = arguments.binary, collections.defaultdict(list)
    images = json.loads((arguments.dataset / "annotations.json").read_text())["images"]
    for camera, group in groupby(images, lambda image: image["calibration"]):
        shots = list(group)
        frames = [str(arguments.dataset / "images" / image["file_name"]) for image in shots]
        true = json.loads((arguments.dataset / "calibrations" / f"{camera}.json").read_text())
        true_m, people = true["mount"]["height_m"], [person for shot in shots for person in shot["people"]]
        for person, place in zip(people, floor(true, true_m, people), strict=True):
            person["floor_m"] = place.tolist()
        tilt = math.degrees(math.acos(-true["mount"]["world_up"][2]))
        statures = [person["stature_m"] for person in people]
        names = len({person["person"] for person in people})
        print(
            f"{camera}: {true['lens']['model']}, {true['image']['width']} pixels, {tilt:.0f}°, {true_m:.2f} m, {len(frames)} frames, "
            f"{len(people)} people ({names} different), mean {np.mean(statures):.3f} m, {min(statures):.2f} to {max(statures):.2f} m"
        )
        circle, _, _ = run(binary, "fit", "--circle-only", frames[0])
        if circle is not None:
            print(f"  circle, true height: {add(places, 'circle and true height', circle, true_m, people)}", flush=True)
        said = from_people(places, "true lens", binary, true, frames, true_m, people, arguments.profile)
        print(f"  true lens: {said}", flush=True)
        for count in FRAMES:
            name = f"fit from {count}"
            found, reason, _ = run(binary, "fit", *frames[:: max(1, len(frames) // count)][:count])
            if found is None:
                places[f"{name}: refused"].append(reason)
                print(f"  {name}: {reason}")
                continue
            row = errors(found, true)
            for kind, value in row.items():
                places[f"{name}: {kind}"].append(value)
            at_true = add(places, f"{name} and true height", found, true_m, people)
            said = from_people(places, name, binary, found, frames, true_m, people, arguments.profile)
            print(
                f"  {name}: { ({k: round(v, 2) for k, v in row.items()}) }, true height {at_true}; {said}", flush=True
            )
    for name, values in places.items():
        if isinstance(values[0], str):
            print(f"{name}: {dict(collections.Counter(values))}")
        else:
            summary(name, values)


if __name__ == "__main__":
    main()
