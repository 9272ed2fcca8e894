"""Composes a short sequence of persons who walk on circles below the camera, with the true crossings of two lines.

A camera that looks straight down may be turned about its axis: a crop at another azimuth is exact, so a walk on a circle
needs no new rendering. The first and the last frame join, so that the sequence can be repeated without a jump.
"""

import bisect
import json
import math
from dataclasses import dataclass

import cv2
import numpy as np

from .compose import compose
from .crops import CropFile, RoomFile
from .geometry import Calibration, camera_rotation
from .look import apply_look
from .placement import Placement
from .progress import Progress

ROOM = 1000014
FRAMES_PER_SECOND = 5
SECONDS = 36
SIDE = 960
NAME = "walks"
LINES = {"south": 180.0, "west": 250.0}
"""Azimuths of the radial lines in degrees, clockwise in the frame from its top."""
LINE_ENDS_M = (0.5, 5.8)
DIRECTIONS = ("clockwise", "anticlockwise")
BAND_M = 0.3
"""A crossing ends beyond this distance from the line."""
SWAY_M, SWAY_SECONDS = 0.15, 2.0
"""Persons who stand shift their weight, and those on a line hesitate across it."""
LOOK = dict(
    kind="day",
    exposure=1.0,
    contrast=1.1,
    vignette=0.2,
    blur=0.4,
    rim_blur=0.5,
    fringe=0.0,
    glare=0.0,
    veil=0.0,
    noise=0.003,
    balance=[1.0, 1.0],
    saturation=0.95,
    sharpen=0.3,
    quality=92,
    detail=1,
)


@dataclass(frozen=True)
class Walk:
    """A crop and its azimuths in degrees at times in seconds: straight between two, standing between two equal ones."""

    seed: int
    view_number: int
    places: tuple

    def azimuth(self, seconds, distance):
        """Radians at a time; `distance` in meters is the radius of the circle."""
        times = [time for time, _ in self.places]
        after = min(max(1, bisect.bisect_right(times, seconds)), len(times) - 1)
        (begin, first), (end, last) = self.places[after - 1 : after + 1]
        azimuth = math.radians(first + (last - first) * (seconds - begin) / (end - begin))
        if first == last:
            azimuth += SWAY_M / distance * math.sin(2 * math.pi * (seconds - begin) / SWAY_SECONDS)
        return azimuth


WALKS = (
    # Three circles, with a pause on the line.
    Walk(1000152, 4, ((0, 90), (8, -180), (12, -180), (36, -990))),
    # Nearly a circle and back; hesitates on the line and walks on.
    Walk(2000009, 1, ((0, 80), (2, 80), (9, 250), (13, 250), (20, 400), (22, 400), (34, 80), (36, 80))),
    # Hesitates on the line, turns back, and crosses later.
    Walk(1000132, 1, ((0, 100), (2, 100), (7, 180), (11, 180), (14, 130), (23, 290), (25, 290), (35, 100), (36, 100))),
    # Crosses both lines, returns over one, hesitates on the other and turns back before it crosses.
    Walk(
        1000184,
        7,
        ((0, 300), (2, 300), (8, 215), (12, 150), (14, 150), (20, 250), (24, 250), (27, 215), (33, 300), (36, 300)),
    ),
    # There and back, far from the camera.
    Walk(1000145, 7, ((0, 265), (2, 265), (16, 100), (18, 100), (32, 265), (36, 265))),
)


def crossings(azimuths, distance):
    """The number of crossings of each line in each direction, from azimuths in radians over time."""
    counts = {line: dict.fromkeys(DIRECTIONS, 0) for line in LINES}
    for line, degrees in LINES.items():
        side = 0
        for azimuth in azimuths:
            offset = math.remainder(azimuth - math.radians(degrees), 2 * math.pi)
            # Far from the line, both sides meet behind the camera.
            if abs(offset) > math.pi / 2:
                side = 0
            elif abs(math.sin(offset)) * distance > BAND_M:
                now = 1 if offset > 0 else -1
                if side == -now:
                    counts[line][DIRECTIONS[0] if now > 0 else DIRECTIONS[1]] += 1
                side = now
    return counts


def calibration_of(height):
    """The camera: it looks straight down through an equidistant lens of 180°."""
    lens = dict(model="equidistant", focal=SIDE / math.pi, max_theta=math.pi / 2)
    return Calibration(SIDE, SIDE, lens, (SIDE - 1) / 2, (SIDE - 1) / 2, camera_rotation(0.0), height)


def native(calibration):
    """The native calibration with the lines. The floor has x to the right of the frame and y down."""

    def end(degrees, distance):
        azimuth = math.radians(degrees)
        return [round(distance * math.sin(azimuth), 3), round(-distance * math.cos(azimuth), 3)]

    lines = [
        dict(name=line, floor_m=[end(degrees, distance) for distance in LINE_ENDS_M], directions=list(DIRECTIONS))
        for line, degrees in LINES.items()
    ]
    return dict(calibration.native(NAME), lines=lines)


def make_walks(work):
    """Writes `WORK/walks`: the frames `0.jpg` …, the calibration and the true crossings of one round."""
    folder = work / "walks"
    folder.mkdir(parents=True, exist_ok=True)
    find = lambda kind, seed: next((work / kind).glob(f"*/{seed}.npz"))
    room = RoomFile(find("rooms", ROOM))
    height = room.about["camera_height"]
    files = [CropFile(find("persons", walk.seed)) for walk in WALKS]
    scales = [height / file.views[walk.view_number]["camera_height"] for walk, file in zip(WALKS, files, strict=True)]
    radii = [
        file.views[walk.view_number]["distance"] * scale for walk, file, scale in zip(WALKS, files, scales, strict=True)
    ]
    calibration = calibration_of(height)
    times = [number / FRAMES_PER_SECOND for number in range(SECONDS * FRAMES_PER_SECOND)]
    truth = {line: dict.fromkeys(DIRECTIONS, 0) for line in LINES}
    for walk, radius in zip(WALKS, radii, strict=True):
        for line, counts in crossings([walk.azimuth(time, radius) for time in times], radius).items():
            for direction, count in counts.items():
                truth[line][direction] += count
    (folder / f"{NAME}.json").write_text(json.dumps(native(calibration), indent=1) + "\n")
    about = dict(seconds=SECONDS, frames_per_second=FRAMES_PER_SECOND, persons=len(WALKS), crossings=truth)
    (folder / "truth.json").write_text(json.dumps(about, indent=1) + "\n")
    progress = Progress("walks", len(times), work / "log" / "walks.log")
    for number, time in enumerate(times):
        path = folder / f"{number}.jpg"
        if not path.exists():
            placements = [
                Placement(file, walk.view_number, walk.azimuth(time, radius), scale)
                for walk, file, scale, radius in zip(WALKS, files, scales, radii, strict=True)
            ]
            composition = compose(calibration, room, placements)
            image = apply_look(np.random.default_rng(number), LOOK, composition, calibration)
            cv2.imwrite(str(path), image, [cv2.IMWRITE_JPEG_QUALITY, LOOK["quality"]])
        progress.step()
