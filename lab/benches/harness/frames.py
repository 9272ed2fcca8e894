"""Generates the frames and calibrations for load tests from the samples, reproducibly."""

import json
from pathlib import Path

import cv2
import numpy as np

from .places import SAMPLES, WORK

SIDE = 1680
"""The side of a common camera's frames, pixels."""
NOISE = 2.0
"""The standard deviation of the noise that replaces the detail missing after enlarging, gray levels."""
QUALITY = 90


def frame(side: int = SIDE, sample: str = "office") -> Path:
    """A JPEG of `side` × `side` pixels."""
    file = WORK / f"{sample}-{side}.jpg"
    if not file.exists():
        WORK.mkdir(parents=True, exist_ok=True)
        image = cv2.imread(str(SAMPLES / f"{sample}.jpg"))
        way = cv2.INTER_AREA if side < image.shape[0] else cv2.INTER_CUBIC
        scaled = cv2.resize(image, (side, side), interpolation=way).astype(np.float32)
        noise = np.random.default_rng(side).normal(0.0, NOISE, (side, side, 1))
        noisy = np.clip(np.rint(scaled + noise), 0, 255).astype(np.uint8)
        written, jpeg = cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        assert written
        file.write_bytes(jpeg.tobytes())
    return file


def calibration(sample: str = "office") -> Path:
    """The calibration of a sample, for all frame sizes."""
    return SAMPLES / "calibrations" / f"{sample}.json"


def cameras(folder: Path, count: int) -> list[str]:
    """Writes calibrations of `count` office cameras into a folder; returns their IDs."""
    written = json.loads(calibration().read_text(encoding="utf-8"))
    ids = [f"camera-{number:04}" for number in range(count)]
    for camera in ids:
        (folder / f"{camera}.json").write_text(json.dumps(written | {"id": camera}), encoding="utf-8")
    return ids
