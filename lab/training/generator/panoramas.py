"""Writes rooms as frames of cameras that look straight down, with their calibrations: `WORK/panoramas/SPLIT`.

The folder is a data set for `lab/calibration/tilted_rooms.py`, which remaps its frames to tilted cameras.
"""

import json
import math

import cv2
import numpy as np

from .crops import RoomFile
from .geometry import Calibration
from .scene import display

LARGEST = math.radians(100)
"""Angle from the nadir to which a frame reaches."""


def write_panorama(path, folder):
    """Writes the frame and the calibration of a room, and returns its entry of the data set."""
    room = RoomFile(path)
    about, name = room.about, path.stem
    max_theta = min(about["max_theta"], LARGEST)
    half = round(about["focal"] * max_theta)
    first = max(0, round(about["nadir"]) - half)
    kept = slice(first, first + 2 * half + 1)
    frame = display(room.colour[kept, kept], about["exposure"])
    nadir = about["nadir"] - first
    lens = dict(model="equidistant", focal=about["focal"], max_theta=max_theta)
    height, width = frame.shape[:2]
    calibration = Calibration(width, height, lens, nadir, nadir, height_m=about["camera_height"])
    cv2.imwrite(str(folder / "images" / f"{name}.png"), np.ascontiguousarray(frame[..., ::-1]))
    (folder / "calibrations" / f"{name}.json").write_text(json.dumps(calibration.native(name), indent=1))
    return dict(id=about["seed"], file_name=f"{name}.png", calibration=name, width=width, height=height)


def write_panoramas(work, split):
    folder = work / "panoramas" / split
    for name in ("images", "calibrations"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    paths = [path for path in sorted((work / "rooms" / split).glob("*.npz")) if "partial" not in path.name]
    images = [write_panorama(path, folder) for path in paths]
    (folder / "annotations.json").write_text(json.dumps(dict(images=images, annotations=[])))
