#!/usr/bin/env python3
"""Enlarge the small frames of a data set of `tilted_rooms.py`, as cameras do that deliver more pixels than they see.

    python scripts/enlarged_frames.py DATASET OUT [--side 1680]

Frames whose longer side is smaller than SIDE pixels are enlarged to it, with their calibrations; others are left out.
Needs opencv-python-headless.
"""

import argparse
import json
from pathlib import Path

import cv2

QUALITY = 90


def enlarged(calibration, width, height):
    """The calibration of a frame after it was enlarged to a size."""
    lens, before = dict(calibration["lens"]), calibration["image"]
    factors = {"cx": width / before["width"], "cy": height / before["height"]}
    for axis, factor in factors.items():
        lens[axis] = (lens[axis] + 0.5) * factor - 0.5
    for focal in ("focal", "fx", "fy"):
        if focal in lens:
            lens[focal] *= max(width, height) / max(before.values())
    return calibration | {"lens": lens, "image": {"width": width, "height": height}}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--side", type=int, default=1680, help="pixels")
    arguments = parser.parse_args()
    for folder in ["images", "calibrations"]:
        (arguments.out / folder).mkdir(parents=True, exist_ok=True)
    dataset = json.loads((arguments.dataset / "annotations.json").read_text())
    images = []
    for image in dataset["images"]:
        longer = max(image["width"], image["height"])
        if longer >= arguments.side:
            continue
        width, height = (round(image[side] * arguments.side / longer) for side in ("width", "height"))
        frame = cv2.imread(str(arguments.dataset / "images" / image["file_name"]))
        frame = cv2.resize(frame, (width, height), interpolation=cv2.INTER_CUBIC)
        cv2.imwrite(str(arguments.out / "images" / image["file_name"]), frame, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        file = Path("calibrations") / f"{image['calibration']}.json"
        calibration = json.loads((arguments.dataset / file).read_text())
        (arguments.out / file).write_text(json.dumps(enlarged(calibration, width, height), indent=1))
        kept = {key: value for key, value in image.items() if key != "people"}
        images.append(kept | {"width": width, "height": height})
    (arguments.out / "annotations.json").write_text(json.dumps(dataset | {"images": images}, indent=1))


if __name__ == "__main__":
    main()
