#!/usr/bin/env python3
"""Make frames of tilted cameras from the rendered rooms of a data set, with their true calibrations.

    python scripts/tilted_rooms.py DATASET OUT [--variants 4] [--seed 1] [--first 0] [--step 1]

Each frame of the data set is remapped to another lens: a model of five, a tilt of 0 to 25 degrees, a
center off by up to 2 % of the width, a circle cut at 75 to 100 degrees. Some variants add noise, blur,
compression or darkness. OUT becomes a data set folder without persons, for `fit_rooms.py`.
Needs numpy and opencv-python-headless.
"""

import argparse
import json
import math
from pathlib import Path

import cv2
import numpy as np

MODELS = ["equidistant", "equisolid", "stereographic", "orthographic", "kannala_brandt"]
#: Changes of the frame after the remap; each with its probability.
DEGRADATIONS = {"none": 0.4, "noise": 0.15, "blur": 0.15, "jpeg": 0.15, "dark": 0.15}
#: Coefficients of two real lenses, and of two between the ideal models.
KANNALA_BRANDT = [
    [0.0246, -0.0210, 0.0081, -0.0012],
    [-0.0143, 0.0085, -0.0037, 0.0006],
    [-0.03, 0.002, 0.0, 0.0],
    [0.03, -0.004, 0.0, 0.0],
]


def radius(lens, theta):
    """The radius in pixels at an angle from the axis."""
    model = lens["model"]
    if model == "equidistant":
        return lens["focal"] * theta
    if model == "equisolid":
        return 2 * lens["focal"] * np.sin(theta / 2)
    if model == "stereographic":
        return 2 * lens["focal"] * np.tan(theta / 2)
    if model == "orthographic":
        return lens["focal"] * np.sin(np.minimum(theta, math.pi / 2))
    if model == "kannala_brandt":
        odd = theta + sum(k * theta ** (2 * n + 3) for n, k in enumerate(lens["k"]))
        return lens["fx"] * odd
    raise ValueError(f"{model}: not a model of the rendered rooms")


def made_lens(generator, width, height):
    """A random lens whose circle lies in a frame of this size."""
    model = str(generator.choice(MODELS))
    ends = {"orthographic": 88.0, "stereographic": 95.0}
    max_theta = math.radians(generator.uniform(75, ends.get(model, 100)))
    side = min(width, height)
    shift, toward = 0.02 * side * math.sqrt(generator.uniform()), generator.uniform(0, 2 * math.pi)
    cx = (width - 1) / 2 + shift * math.cos(toward)
    cy = (height - 1) / 2 + shift * math.sin(toward)
    lens = {"model": model, "cx": round(cx, 3), "cy": round(cy, 3), "max_theta": round(max_theta, 6)}
    if model == "kannala_brandt":
        lens |= {"fx": 1.0, "fy": 1.0, "k": KANNALA_BRANDT[generator.integers(len(KANNALA_BRANDT))]}
    else:
        lens["focal"] = 1.0
    focal = round(side * generator.uniform(0.46, 0.5) / float(radius(lens, max_theta)), 4)
    return lens | ({"fx": focal, "fy": focal} if "fx" in lens else {"focal": focal})


def remap(frame, source, lens, down):
    """The frame of the camera `lens` whose nadir is `down`, from a frame of one that looks straight down."""
    height, width = frame.shape[:2]
    x, y = np.meshgrid(np.arange(width) - lens["cx"], np.arange(height) - lens["cy"])
    r = np.hypot(x, y)
    angles = np.linspace(0, lens["max_theta"], 4001)
    theta = np.interp(r, radius(lens, angles), angles, right=np.nan)
    scale = np.where(r > 0, np.sin(theta) / np.maximum(r, 1e-9), 0)
    ray = np.stack([x * scale, y * scale, np.cos(theta)], -1)
    # The smallest rotation that turns the nadir into the axis of the source.
    axis = np.cross(down, [0, 0, 1])
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    ray = ray @ (np.eye(3) + skew + skew @ skew / (1 + down[2])).T
    there = np.arccos(np.clip(ray[..., 2], -1, 1))
    there = np.where(there <= source["max_theta"], there, np.nan)
    around = np.arctan2(ray[..., 1], ray[..., 0])
    r = radius(source, there)
    at = [source["cx"] + r * np.cos(around), source["cy"] + r * np.sin(around)]
    at = [np.nan_to_num(value, nan=-10).astype(np.float32) for value in at]
    return cv2.remap(frame, *at, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT)


def degrade(frame, kind, generator):
    """The frame with noise, blur or darkness."""
    if kind == "noise":
        frame = frame + generator.normal(0, generator.uniform(5, 15), frame.shape)
    if kind == "blur":
        frame = cv2.GaussianBlur(frame, (0, 0), generator.uniform(0.8, 1.8))
    if kind == "dark":
        gain = generator.uniform(0.12, 0.3)
        frame = np.round(frame * gain) + generator.normal(0, 2, frame.shape)
    return np.clip(frame, 0, 255).astype(np.uint8)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--variants", type=int, default=4, help="frames from each room")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first room")
    parser.add_argument("--step", type=int, default=1, help="take each STEPth room")
    arguments = parser.parse_args()
    generator = np.random.default_rng(arguments.seed)
    for folder in ["images", "calibrations"]:
        (arguments.out / folder).mkdir(parents=True, exist_ok=True)
    rooms = json.loads((arguments.dataset / "annotations.json").read_text())["images"]
    images = []
    for room in rooms[arguments.first :: arguments.step]:
        path = arguments.dataset / "calibrations" / f"{room['calibration']}.json"
        source = json.loads(path.read_text())
        frame = cv2.imread(str(arguments.dataset / "images" / room["file_name"]))
        height, width = frame.shape[:2]
        for variant in range(arguments.variants):
            name = f"{Path(room['file_name']).stem}_{variant}"
            lens = made_lens(generator, width, height)
            tilt, toward = math.radians(generator.uniform(0, 25)), generator.uniform(0, 2 * math.pi)
            flat = math.sin(tilt)
            down = [flat * math.cos(toward), flat * math.sin(toward), math.cos(tilt)]
            kind = str(generator.choice(list(DEGRADATIONS), p=list(DEGRADATIONS.values())))
            made = degrade(remap(frame, source["lens"], lens, np.array(down)), kind, generator)
            quality = 50 if kind == "jpeg" else 92
            cv2.imwrite(
                str(arguments.out / "images" / f"{name}.jpg"), made, [cv2.IMWRITE_JPEG_QUALITY, quality]
            )
            mount = source["mount"] | {"world_up": [-round(value, 8) for value in down]}
            calibration = {"id": name, "image": source["image"], "lens": lens, "mount": mount}
            (arguments.out / "calibrations" / f"{name}.json").write_text(json.dumps(calibration, indent=1))
            images.append(
                {
                    "id": len(images) + 1,
                    "file_name": f"{name}.jpg",
                    "width": width,
                    "height": height,
                    "calibration": name,
                    "degradation": kind,
                }
            )
    coco = {"images": images, "annotations": [], "categories": [{"id": 1, "name": "person"}]}
    (arguments.out / "annotations.json").write_text(json.dumps(coco, indent=1))


if __name__ == "__main__":
    main()
