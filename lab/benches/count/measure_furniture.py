"""The motion of boxes: of things that stand still in a clip, and of people whose image is moved.

    measure_furniture.py still REPORTS.jsonl
    measure_furniture.py moved LOOKDOWN CALIBRATION FRAME WORK

The reports are those of `lookdown detect FRAMES --score-threshold 0.06`. WORK is a folder for the moved frames.
"""

import json
import math
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np

FRAMES_OF_MEAN = 50
"""10 s at 5 frames per second."""
NEAR = 0.35
"""Boxes nearer than this, in square roots of the area, are of one thing."""
SHIFTS = (0.03, 0.06, 0.12)
NOISY_FRAMES = 8
NOISE = 3.0
JPEG_QUALITY = 85
LEAST_SCORE = 0.5
MOST_PERSONS = 14


def row(person: dict) -> np.ndarray:
    """Center, logarithms of the size, and score of a person."""
    box = person["oriented_box"]
    return np.array([box["cx"], box["cy"], math.log(box["width"]), math.log(box["height"]), person["score"]])


def unit(one: np.ndarray) -> float:
    """The square root of the area."""
    return math.exp((one[2] + one[3]) / 2)


def distance(one: np.ndarray, other: np.ndarray) -> float:
    """The distance of two centers."""
    return math.dist(one[:2], other[:2]) / unit(one)


def motion(one: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """The motion of the center and the change of the size."""
    return distance(one, other), float(np.abs(one[2:4] - other[2:4]).max())


def still(reports: Path) -> None:
    """Prints the motion of the boxes that are in half of the frames."""
    frames = [json.loads(line)["persons"] for line in reports.read_text(encoding="utf-8").splitlines()]
    things: list[list[tuple[int, np.ndarray]]] = []
    for frame, persons in enumerate(frames):
        for one in map(row, persons):
            near = [thing for thing in things if distance(thing[0][1], one) < NEAR]
            near = [thing for thing in near if thing[-1][0] < frame]
            if near:
                min(near, key=lambda thing: distance(thing[0][1], one)).append((frame, one))
            else:
                things.append([(frame, one)])
    for thing in things:
        if len(thing) < len(frames) / 2:
            continue
        rows = np.array([one for _, one in thing])
        deviation = rows.std(0)
        groups = range(len(frames) // FRAMES_OF_MEAN)
        grouped = [[one for frame, one in thing if frame // FRAMES_OF_MEAN == group] for group in groups]
        means = [np.mean(group, 0) for group in grouped if group]
        motions = [motion(one, other) for one in means for other in means]
        center = math.hypot(*deviation[:2]) / unit(rows.mean(0))
        most = np.max(motions, 0)
        print(f"score {rows[:, 4].mean():.2f}: {center:.3f}, {deviation[2:4].max():.3f}; {most[0]:.3f}, {most[1]:.3f}")


def moved(lookdown: str, calibration: str, frame: str, work: Path) -> None:
    """Prints the motion of boxes when the image of each person is shifted smoothly."""
    random = np.random.default_rng(1)
    image = cv2.imread(frame)
    down, right = np.mgrid[0 : image.shape[0], 0 : image.shape[1]].astype(np.float32)

    def save(name: str, changed: np.ndarray) -> str:
        noisy = changed + random.normal(0, NOISE, changed.shape)
        path = work / f"{name}.jpg"
        cv2.imwrite(str(path), np.clip(noisy, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        return str(path)

    def detect(paths: list[str]) -> list[list[np.ndarray]]:
        options = ["--calibration", calibration, "--profile", "fast", "--score-threshold", "0.06"]
        done = subprocess.run([lookdown, "detect", *paths, *options], check=True, capture_output=True, text=True)
        return [[row(person) for person in json.loads(line)["persons"]] for line in done.stdout.splitlines()]

    people = [one for one in detect([save("first", image)])[0] if one[4] > LEAST_SCORE][:MOST_PERSONS]

    def shifted(share: float, degrees: int) -> np.ndarray:
        x, y = right.copy(), down.copy()
        for one in people:
            away = (right - one[0]) ** 2 + (down - one[1]) ** 2
            weight = share * unit(one) * np.exp(-away / (2 * (0.45 * unit(one)) ** 2))
            x -= weight * math.cos(math.radians(degrees))
            y -= weight * math.sin(math.radians(degrees))
        return cv2.remap(image, x, y, cv2.INTER_LINEAR)

    paths = [save(f"still{number}", image) for number in range(NOISY_FRAMES)]
    turns = [(share, degrees) for share in SHIFTS for degrees in range(0, 360, 90)]
    paths += [save(f"moved{share}_{degrees}", shifted(share, degrees)) for share, degrees in turns]
    found = detect(paths)
    rows = []
    for person in people:
        nearest = [min(persons, key=lambda one, person=person: distance(person, one)) for persons in found]
        quiet = np.array([one for one in nearest[:NOISY_FRAMES] if distance(person, one) < NEAR])
        mean = quiet.mean(0)
        values = [math.hypot(*quiet.std(0)[:2]) / unit(mean), float(quiet.std(0)[2:4].max())]
        for share in SHIFTS:
            of_share = [one for (used, _), one in zip(turns, nearest[NOISY_FRAMES:], strict=True) if used == share]
            values += list(np.mean([motion(mean, one) for one in of_share if distance(mean, one) < NEAR], 0))
        rows.append(values)
    print("still, then each shift:", " ".join(f"{value:.3f}" for value in np.median(rows, 0)))


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["still", reports]:
            still(Path(reports))
        case ["moved", lookdown, calibration, frame, work]:
            moved(lookdown, calibration, frame, Path(work))
        case _:
            sys.exit(__doc__)
