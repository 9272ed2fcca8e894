"""Makes a clip in which people enter and leave from the clip of the walks: `entering_walkers.py VIDEO FOLDER`.

Prints the true number of people of each frame as JSON. A person who is not there is replaced by the median of the clip, the
mannequin by a part of the floor. Where the walks go is known: `lab/training/generator/walks.py`.
"""

import bisect
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SIDE, RATE, LOOP_SECONDS = 960, 5, 36
CENTER = (SIDE - 1) / 2
MEDIAN_STEP = 4


@dataclass(frozen=True)
class Walker:
    """The azimuths in degrees at times in seconds, the pixels from the center, and when the walker is there."""

    places: tuple[tuple[float, float], ...]
    radii_px: tuple[float, float]
    half_width_deg: float
    there: tuple[float, float]

    def azimuth(self, seconds: float) -> float:
        """The azimuth at a time, clockwise from the top of the frame."""
        times = [time for time, _ in self.places]
        after = min(max(1, bisect.bisect_right(times, seconds)), len(times) - 1)
        (begin, first), (end, last) = self.places[after - 1 : after + 1]
        return first + (last - first) * (seconds - begin) / (end - begin)

    def distance(self, seconds: float) -> np.ndarray:
        """How far each pixel is from the walker, 1 where it ends."""
        offset = np.abs(np.remainder(AZIMUTH - self.azimuth(seconds) + 180, 360) - 180) / self.half_width_deg
        inner, outer = self.radii_px
        return np.maximum(offset, np.abs(2 * RADIUS - inner - outer) / (outer - inner))

    def is_there(self, seconds: float) -> bool:
        """True while the walker is in the clip that is made."""
        return self.there[0] <= seconds < self.there[1]


ROWS, COLUMNS = np.mgrid[:SIDE, :SIDE].astype(np.float32) - CENTER
RADIUS = np.hypot(ROWS, COLUMNS)
AZIMUTH = np.degrees(np.arctan2(COLUMNS, -ROWS))
WALKERS = (
    Walker(((0, 90), (8, -180), (12, -180), (36, -990)), (120, 335), 28, (6, 48)),
    Walker(((0, 80), (2, 80), (9, 250), (13, 250), (20, 400), (22, 400), (34, 80), (36, 80)), (130, 385), 22, (6, 42)),
    Walker(
        ((0, 100), (2, 100), (7, 180), (11, 180), (14, 130), (23, 290), (25, 290), (35, 100), (36, 100)),
        (240, 435),
        15,
        (12, 42),
    ),
    Walker(
        ((0, 300), (2, 300), (8, 215), (12, 150), (14, 150), (20, 250), (24, 250), (27, 215), (33, 300), (36, 300)),
        (170, 400),
        20,
        (12, 36),
    ),
    Walker(((0, 265), (2, 265), (16, 100), (18, 100), (32, 265), (36, 265)), (280, 455), 13, (18, 36)),
    Walker(((0, 58), (36, 58)), (185, 350), 22, (18, 30)),
)
"""The last one is the mannequin."""
FLOOR_TURN_DEG = 60
"""The floor this much further clockwise is empty."""
SECONDS = 60


def frames_of(video: str) -> np.ndarray:
    """The frames of a video."""
    command = ["ffmpeg", "-v", "error", "-i", video, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, SIDE, SIDE, 3)


def empty_room(frames: np.ndarray) -> np.ndarray:
    """The room without walkers and mannequin."""
    room = np.median(frames[::MEDIAN_STEP], axis=0).astype(np.uint8)
    turn = np.radians(FLOOR_TURN_DEG)
    rows = np.rint(CENTER + ROWS * np.cos(turn) + COLUMNS * np.sin(turn)).astype(int).clip(0, SIDE - 1)
    columns = np.rint(CENTER + COLUMNS * np.cos(turn) - ROWS * np.sin(turn)).astype(int).clip(0, SIDE - 1)
    mask = WALKERS[-1].distance(0) < 1
    turned = room[rows, columns]
    room[mask] = turned[mask]
    return room


def main(video: str, folder: str) -> None:
    """Writes the frames as JPEG files."""
    frames = frames_of(video)
    room = empty_room(frames)
    size = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{SIDE}x{SIDE}", "-r", str(RATE), "-i", "-"]
    images = ["-q:v", "2", "-start_number", "0", str(Path(folder) / "%d.jpg")]
    encoder = subprocess.Popen(["ffmpeg", "-v", "error", *size, *images], stdin=subprocess.PIPE)
    true = []
    for number in range(SECONDS * RATE):
        seconds = number / RATE
        in_loop = seconds % LOOP_SECONDS
        distances = np.stack([walker.distance(in_loop) for walker in WALKERS])
        is_gone = np.array([not walker.is_there(seconds) for walker in WALKERS])
        # A pixel of several walkers belongs to the nearest one.
        gone = is_gone[distances.argmin(axis=0)] & (distances.min(axis=0) < 1)
        frame = frames[number % (LOOP_SECONDS * RATE)].copy()
        frame[gone] = room[gone]
        encoder.stdin.write(frame.tobytes())
        true.append(sum(walker.is_there(seconds) for walker in WALKERS))
    encoder.stdin.close()
    if encoder.wait():
        sys.exit("ffmpeg failed")
    print(json.dumps(true))


if __name__ == "__main__":
    main(*sys.argv[1:])
