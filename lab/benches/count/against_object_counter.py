"""Line crossings of the rendered walks by ultralytics, from the detections of Lookdown:
`against_object_counter.py REPORTS.jsonl`.

The reports are those of `against_line_zone.py`. The trackers of ultralytics follow the boxes, its `ObjectCounter` counts
them, both without a network. It needs `pip install ultralytics shapely lap`, 6 GB with torch.
"""

from collections import defaultdict
from types import SimpleNamespace

import numpy as np
from against_line_zone import SCORES, inputs
from shapely.geometry import LineString, Point
from ultralytics.engine.results import Boxes
from ultralytics.solutions.object_counter import ObjectCounter
from ultralytics.trackers.bot_sort import BOTSORT
from ultralytics.trackers.byte_tracker import BYTETracker
from ultralytics.utils import ROOT, YAML

TRACKERS = {"bytetrack": BYTETracker, "botsort": BOTSORT}
SIDE = 960


def counter_of(ends):
    """A counter for a line, without the network that the constructor loads."""
    counter = ObjectCounter.__new__(ObjectCounter)
    counter.region = [(end.x, end.y) for end in ends]
    counter.LineString, counter.Point, counter.r_s = LineString, Point, LineString(counter.region)
    counter.in_count = counter.out_count = 0
    counter.counted_ids, counter.names = set(), {0: "person"}
    counter.classwise_count = defaultdict(lambda: {"IN": 0, "OUT": 0})
    return counter


def boxes_of(report, score):
    """The boxes of a report from a score on."""
    persons = [person for person in report["persons"] if person["score"] >= score]
    sides = ("x_min", "y_min", "x_max", "y_max")
    rows = [[*(person["box"][side] for side in sides), person["score"], 0] for person in persons]
    return Boxes(np.array(rows, np.float32).reshape(-1, 6), (SIDE, SIDE))


def run(name, reports, counters, score):
    """Follows and counts the boxes of all reports."""
    settings = YAML.load(ROOT / f"cfg/trackers/{name}.yaml") | {"gmc_method": "none", "with_reid": False}
    tracker, last = TRACKERS[name](SimpleNamespace(**settings)), {}
    image = np.zeros((SIDE, SIDE, 3), np.uint8)
    for report in reports:
        for x_min, y_min, x_max, y_max, track in tracker.update(boxes_of(report, score), image)[:, :5]:
            center = ((x_min + x_max) / 2, (y_min + y_max) / 2)
            for counter in counters.values():
                counter.count_objects(center, int(track), last.get(int(track)), 0)
            last[int(track)] = center


def main() -> None:
    """Prints a row for each tracker and score. The two directions are named as is best for the counter."""
    reports, ends, truth = inputs(__doc__)
    print("| tracker | from score | counted | wrong |\n|---|---:|---:|---:|")
    for name in TRACKERS:
        for score in SCORES:
            counters = {line: counter_of(places) for line, places in ends.items()}
            run(name, reports, counters, score)
            counted = wrong = 0
            for line, counter in counters.items():
                found, true = (counter.in_count, counter.out_count), tuple(truth[line].values())
                counted += sum(found)
                ways = (found, found[::-1])
                wrong += min(sum(abs(one - other) for one, other in zip(way, true, strict=True)) for way in ways)
            print(f"| {name} | {score} | {counted} | {wrong} |")


if __name__ == "__main__":
    main()
