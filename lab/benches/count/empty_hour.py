"""Writes a time lapse of a room without people with the light of an hour: `empty_hour.py FRAME FOLDER [--frames N]`.

FRAME shows the room, such as one of `lab/training/make.py empty`. A cloud passes twice, the sun moves to a side of the
room, lamps are switched on in the last quarter, and each frame has noise and a JPEG of its own. `lookdown detect` and
the example `replay` of the crate lookdown-count then say how many people are counted (docs/lab/count-accuracy.md).
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

SEED = 3
CLOUD_DEPTH = 0.55
"""Share of the light that a cloud takes."""
CLOUDS = ((0.25, 0.05), (0.55, 0.03))
"""Middle and width of each cloud, as shares of the hour."""
LAMPS_FROM = 0.75
LAMP_GAINS = (1.1, 1.25, 1.4)
"""Blue, green and red."""
SUN_GAIN = 0.5
NOISE_LEVELS = 3.0
JPEG_QUALITY = (60, 92)


def light(share: float, side: np.ndarray) -> np.ndarray:
    """The gains of all pixels and channels at a share of the hour; `side` is 0 at the left and 1 at the right."""
    clouds = sum(np.exp(-(((share - middle) / width) ** 2)) for middle, width in CLOUDS)
    sun = SUN_GAIN * np.exp(-(((side - share) / 0.2) ** 2))
    day = (1 - CLOUD_DEPTH * min(clouds, 1.0)) * (1 + sun)
    lamps = np.array(LAMP_GAINS if share >= LAMPS_FROM else (1.0, 1.0, 1.0))
    return day[None, :, None] * lamps


def main() -> None:
    """Writes the frames as `0000.jpg`, `0001.jpg` …"""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("frame", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--frames", type=int, default=400, help="frames in the hour")
    options = parser.parse_args()
    room = cv2.imread(str(options.frame)).astype(np.float32)
    side = np.linspace(0, 1, room.shape[1])
    random = np.random.default_rng(SEED)
    options.folder.mkdir(parents=True, exist_ok=True)
    for number in range(options.frames):
        lit = room * light(number / options.frames, side)
        noisy = lit + random.normal(0, NOISE_LEVELS, room.shape)
        quality = int(random.integers(*JPEG_QUALITY))
        file = options.folder / f"{number:04}.jpg"
        cv2.imwrite(str(file), np.clip(noisy, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality])


if __name__ == "__main__":
    main()
