"""Line crossings of the rendered walks by supervision, from the detections of Lookdown:
`against_line_zone.py REPORTS.jsonl`.

REPORTS.jsonl is what `lookdown detect` prints for the frames of `tests/real/walks/walks.mp4`, in order. ByteTrack (package
`trackers`) follows the boxes, `LineZone` counts them on the lines of the calibration. Without lens distortion, a line
through the place below the camera is straight in the frame.
"""

import argparse
import itertools
import json
import math
from pathlib import Path

import numpy as np
import supervision as sv
from trackers import ByteTrackTracker

CLIP = Path(__file__).resolve().parents[3] / "tests/real/walks"
FRAME_RATE = 5
SCORES = (0.06, 0.3, 0.5)
ANCHORS = {"center": sv.Position.CENTER, "bottom center": sv.Position.BOTTOM_CENTER, "all corners": None}


def pixel_of(calibration, floor):
    """The pixel of a place on the floor, for the equidistant lens of the clip, which looks straight down."""
    lens, height = calibration["lens"], calibration["mount"]["height_m"]
    distance = math.hypot(*floor)
    radius = lens["focal"] * math.atan2(distance, height)
    return sv.Point(lens["cx"] + radius * floor[0] / distance, lens["cy"] + radius * floor[1] / distance)


def detections(report, score):
    """The detections of a report from a score on."""
    persons = [person for person in report["persons"] if person["score"] >= score]
    sides = ("x_min", "y_min", "x_max", "y_max")
    return sv.Detections(
        xyxy=np.array([[person["box"][side] for side in sides] for person in persons], float).reshape(-1, 4),
        confidence=np.array([person["score"] for person in persons], float),
        class_id=np.zeros(len(persons), int),
    )


def count(reports, ends, score, anchor):
    """The crossings of a line in its two directions."""
    tracker = ByteTrackTracker(frame_rate=FRAME_RATE)
    zone = sv.LineZone(*ends, **({"triggering_anchors": [anchor]} if anchor else {}))
    for index, report in enumerate(reports):
        zone.trigger(tracker.update(detections(report, score), timestamp=index / FRAME_RATE))
    # Out is clockwise for a line that leads away from the place below the camera.
    return {"clockwise": zone.out_count, "anticlockwise": zone.in_count}


def main() -> None:
    """Prints a row for each choice of score and anchor."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("reports", type=Path, help="one report per line")
    reports = [json.loads(line) for line in parser.parse_args().reports.read_text(encoding="utf-8").splitlines()]
    calibration = json.loads((CLIP / "calibration.json").read_text(encoding="utf-8"))
    ends = {line["name"]: [pixel_of(calibration, place) for place in line["floor_m"]] for line in calibration["lines"]}
    truth = json.loads((CLIP / "truth.json").read_text(encoding="utf-8"))["crossings"]
    print("| from score | anchor | counted | wrong |\n|---|---|---:|---:|")
    for score, (name, anchor) in itertools.product(SCORES, ANCHORS.items()):
        counted = wrong = 0
        for line, places in ends.items():
            found = count(reports, places, score, anchor)
            counted += sum(found.values())
            wrong += sum(abs(found[direction] - true) for direction, true in truth[line].items())
        print(f"| {score} | {name} | {counted} | {wrong} |")


if __name__ == "__main__":
    main()
