#!/usr/bin/env python3
"""Make frames of tilted cameras from the rendered rooms of a data set, with their true calibrations.

    python lab/calibration/tilted_rooms.py DATASET OUT [--variants 4] [--frames 1] [--seed 1] [--first 0] [--step 1] [--tilt 25] [--wall]

Each frame of the data set is remapped to another lens: a model of five, a tilt of 0 to TILT degrees, a
center off by up to 2 % of the width, a circle cut at 75 to 100 degrees. Some variants add noise, blur,
compression or darkness. With several frames of each camera, things of the size of people are in the way in each, and
the degradations differ. With `--wall`, the cameras look horizontally, upright within 10 degrees, below a plain ceiling.
OUT becomes a data set folder for `fit_rooms.py`; its images have the `people` with their feet.
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


def level(down):
    """The smallest rotation that turns a nadir into the axis of the camera."""
    axis = np.cross(down, [0, 0, 1])
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + skew + skew @ skew / (1 + down[2])


def rays(lens, pixels):
    """Unit rays of pixels of shape (..., 2); NaN beyond the circle."""
    x, y = pixels[..., 0] - lens["cx"], pixels[..., 1] - lens["cy"]
    r = np.hypot(x, y)
    angles = np.linspace(0, lens["max_theta"], 4001)
    theta = np.interp(r, radius(lens, angles), angles, right=np.nan)
    scale = np.where(r > 0, np.sin(theta) / np.maximum(r, 1e-9), 0)
    return np.stack([x * scale, y * scale, np.cos(theta)], -1)


def project(lens, ray):
    """Pixels of rays of shape (..., 3); NaN beyond the lens."""
    theta = np.arccos(np.clip(ray[..., 2] / np.linalg.norm(ray, axis=-1), -1, 1))
    r = radius(lens, np.where(theta <= lens["max_theta"], theta, np.nan))
    around = np.arctan2(ray[..., 1], ray[..., 0])
    return np.stack([lens["cx"] + r * np.cos(around), lens["cy"] + r * np.sin(around)], -1)


def remap(frame, source, lens, down):
    """The frame of the camera `lens` whose nadir is `down`, from a frame of one that looks straight down."""
    height, width = frame.shape[:2]
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)
    at = np.nan_to_num(project(source, rays(lens, pixels) @ level(down).T), nan=-10).astype(np.float32)
    return cv2.remap(frame, at[..., 0], at[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT)


def with_ceiling(frame, lens, down, gray):
    """The frame with a plain ceiling above the horizon, which no frame of a level camera shows."""
    height, width = frame.shape[:2]
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)
    frame = frame.copy()
    frame[rays(lens, pixels) @ down < 0] = gray
    return frame


def people(persons, source, lens, down):
    """The feet of the persons in the new frame, and their places on the floor in meters."""
    found = []
    for person in persons:
        ray = rays(source["lens"], np.array(person["feet_px"])) @ level(down)
        pixel = project(lens, ray)
        if np.isfinite(pixel).all():
            floor = rays(source["lens"], np.array(person["feet_px"]))
            floor = source["mount"]["height_m"] * floor[:2] / floor[2]
            found.append({"feet_px": pixel.round(2).tolist(), "floor_m": floor.round(4).tolist()})
    return found


def with_things(frame, lens, generator):
    """The frame with up to six things of the size of people in the way."""
    frame = frame.copy()
    for _ in range(generator.integers(1, 7)):
        far, toward = generator.uniform(0.15, 0.8) * frame.shape[0] / 2, generator.uniform(0, 2 * math.pi)
        at = (round(lens["cx"] + far * math.cos(toward)), round(lens["cy"] + far * math.sin(toward)))
        size = (
            round(generator.uniform(0.05, 0.12) * frame.shape[0]),
            round(generator.uniform(0.02, 0.04) * frame.shape[0]),
        )
        color = [int(value) for value in generator.integers(20, 230, 3)]
        cv2.ellipse(frame, at, size, math.degrees(toward), 0, 360, color, -1, cv2.LINE_AA)
    return frame


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
    parser.add_argument("--frames", type=int, default=1, help="frames of each camera")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first room")
    parser.add_argument("--step", type=int, default=1, help="take each STEPth room")
    parser.add_argument("--tilt", type=float, default=25.0, help="greatest tilt, degrees")
    parser.add_argument("--wall", action="store_true", help="cameras that look horizontally")
    arguments = parser.parse_args()
    generator = np.random.default_rng(arguments.seed)
    for folder in ["images", "calibrations"]:
        (arguments.out / folder).mkdir(parents=True, exist_ok=True)
    dataset = json.loads((arguments.dataset / "annotations.json").read_text())
    rooms = dataset["images"]
    images = []
    for room in rooms[arguments.first :: arguments.step]:
        path = arguments.dataset / "calibrations" / f"{room['calibration']}.json"
        source = json.loads(path.read_text())
        frame = cv2.imread(str(arguments.dataset / "images" / room["file_name"]))
        height, width = frame.shape[:2]
        for variant in range(arguments.variants):
            name = f"{Path(room['file_name']).stem}_{variant}"
            lens = made_lens(generator, width, height)
            tilt, toward = math.radians(generator.uniform(0, arguments.tilt)), generator.uniform(0, 2 * math.pi)
            if arguments.wall:
                tilt, toward = math.radians(generator.uniform(80, 95)), math.radians(generator.uniform(80, 100))
            flat = math.sin(tilt)
            down = [flat * math.cos(toward), flat * math.sin(toward), math.cos(tilt)]
            remapped = remap(frame, source["lens"], lens, np.array(down))
            if arguments.wall:
                remapped = with_ceiling(remapped, lens, np.array(down), float(generator.uniform(120, 220)))
            persons = [person for person in dataset["annotations"] if person["image_id"] == room["id"]]
            mount = source["mount"] | {"world_up": [-round(value, 8) for value in down]}
            calibration = {"id": name, "image": source["image"], "lens": lens, "mount": mount}
            (arguments.out / "calibrations" / f"{name}.json").write_text(json.dumps(calibration, indent=1))
            for shot in range(arguments.frames):
                kind = str(generator.choice(list(DEGRADATIONS), p=list(DEGRADATIONS.values())))
                seen = with_things(remapped, lens, generator) if arguments.frames > 1 else remapped
                made = degrade(seen, kind, generator)
                quality = 50 if kind == "jpeg" else 92
                file = f"{name}.jpg" if arguments.frames == 1 else f"{name}_{shot}.jpg"
                cv2.imwrite(str(arguments.out / "images" / file), made, [cv2.IMWRITE_JPEG_QUALITY, quality])
                images.append(
                    {
                        "id": len(images) + 1,
                        "file_name": file,
                        "width": width,
                        "height": height,
                        "calibration": name,
                        "degradation": kind,
                        "people": people(persons, source, lens, np.array(down)),
                    }
                )
    coco = {"images": images, "annotations": [], "categories": [{"id": 1, "name": "person"}]}
    (arguments.out / "annotations.json").write_text(json.dumps(coco, indent=1))


if __name__ == "__main__":
    main()
