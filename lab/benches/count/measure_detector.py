"""Measures a detector for the simulation of walks: `measure_detector.py LOOKDOWN DATASET DETECTIONS`.

LOOKDOWN is the program, and DETECTIONS a file of `lookdown eval DATASET --save-detections FOLDER`. Prints the constants
of lab/benches/simulate/figures.rs: misses by the angle off the axis, false alarms and the error of
the edges of boxes.
"""

import json
import math
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

THRESHOLD, FLOOR = 0.3, 0.05
"""The default threshold of the server, and the least score that is simulated."""
SCORES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""The recall at these scores is the distribution of a person's score."""
RIGHT, EXACT = 0.5, 0.75
"""The least IoU of a right box, and of one whose edges are counted as exact."""
PART = 0.1
"""False alarms from this IoU with a person on, or with half of their area in its box, are parts or duplicates."""
SAMPLES = 200_000


def recalls(program, dataset, detections, least):
    """Persons and recall by the angle off the axis, of detections from a score on."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "kept.json"
        path.write_text(json.dumps([one for one in detections if one["score"] >= least]), encoding="utf-8")
        command = [program, "eval", dataset, "--from-detections", path, "--by", "distance", "--json"]
        said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return {row["stratum"]: (row["persons"], row["recall"]) for row in json.loads(said)["strata"]}


def smoothed(persons, recall):
    """The mean of the recall with the prior of Jeffreys: 4 of 4 persons do not prove that none is missed."""
    return (persons * recall + 0.5) / (persons + 1)


def corners(boxes):
    """Left, top, right and bottom of boxes with a width and a height."""
    boxes = np.array(boxes, float).reshape(-1, 4)
    return np.concatenate([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]], axis=1)


def common(ones, others):
    """The areas of the intersections of each two boxes, and the areas of both."""
    ones, others = ones[:, None], others[None]
    size = np.clip(np.minimum(ones[..., 2:], others[..., 2:]) - np.maximum(ones[..., :2], others[..., :2]), 0, None)
    areas = [(boxes[..., 2:] - boxes[..., :2]).prod(-1) for boxes in (ones, others)]
    return size.prod(-1), *areas


def judged(dataset, detections):
    """Each detection by falling score in its image, with the IoU of the person that it is right for, if any, and whether it
    overlaps a person; without those in a crowd."""
    truth = json.loads((Path(dataset) / "annotations.json").read_text(encoding="utf-8"))
    persons, found = defaultdict(list), defaultdict(list)
    for one in truth["annotations"]:
        persons[one["image_id"]].append(one)
    for one in detections:
        found[one["image_id"]].append(one)
    for image, ones in found.items():
        best, true = sorted(ones, key=lambda one: -one["score"]), persons[image]
        crowd = np.array([one.get("iscrowd", 0) for one in true], bool)
        both, areas, others = common(corners([one["bbox"] for one in best]), corners([one["bbox"] for one in true]))
        iou, inside = both / (areas + others - both), both / areas
        free = ~crowd
        for row, one in enumerate(best):
            candidates = np.where(free, iou[row], 0)
            overlap = candidates.max(initial=0)
            if overlap >= RIGHT:
                free[candidates.argmax()] = False
                yield one["score"], overlap, True
            elif inside[row][crowd].max(initial=0) < RIGHT:
                yield one["score"], None, iou[row].max(initial=0) >= PART or inside[row].max(initial=0) >= RIGHT


def matched(dataset, detections):
    """IoUs of right boxes from the threshold on, scores of parts and of background, persons and images."""
    truth = json.loads((Path(dataset) / "annotations.json").read_text(encoding="utf-8"))
    overlaps, parts, background = [], [], []
    for score, overlap, is_part in judged(dataset, detections):
        if overlap is None:
            (parts if is_part else background).append(score)
        elif score >= THRESHOLD:
            overlaps.append(overlap)
    count = sum(not one.get("iscrowd", 0) for one in truth["annotations"])
    return np.array(overlaps), np.array(parts), np.array(background), count, len(truth["images"])


def exact_share(deviation):
    """The share of exact boxes among right ones, if each edge has this error as a share of the extent."""
    chance = np.random.default_rng(1)
    low, high = chance.normal(0, deviation, (2, SAMPLES, 2))
    high += 1
    both = np.clip(np.minimum(high, 1) - np.maximum(low, 0), 0, None).prod(-1)
    area = np.clip(high - low, 0, None).prod(-1)
    iou = both / (1 + area - both)
    return (iou >= EXACT).mean() / (iou >= RIGHT).mean()


def edge_error(share):
    """The error of each edge that has this share of exact boxes."""
    low, high = 0.01, 0.3
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if exact_share(middle) > share else (low, middle)
    return (low + high) / 2


def logit(score):
    """The logarithm of the odds."""
    return math.log(score / (1 - score))


def main():
    """Prints the constants."""
    program, dataset, path = sys.argv[1:]
    detections = json.loads(Path(path).read_text(encoding="utf-8"))
    measured = [recalls(program, dataset, detections, score) for score in SCORES]
    for stratum, (persons, _) in measured[0].items():
        if persons:
            shares = ", ".join(f"{smoothed(*row[stratum]):.3f}" for row in measured)
            print(f"{stratum}: {persons} persons, recall {shares}")
    kept = [one for one in detections if one["score"] >= FLOOR]
    overlaps, parts, background, persons, images = matched(dataset, kept)
    share = (overlaps >= EXACT).mean()
    print(f"right boxes: {len(overlaps)}, share of IoU {EXACT}: {share:.3f}, error of an edge {edge_error(share):.3f}")
    for name, scores, base in (("background per frame", background, images), ("parts per person", parts, persons)):
        scale = np.mean([logit(score) - logit(FLOOR) for score in scores])
        share = math.exp((logit(FLOOR) - logit(THRESHOLD)) / scale)
        print(
            f"{name}: {len(scores) / base:.3f} from {FLOOR}, {(scores >= THRESHOLD).sum() / base:.3f} from {THRESHOLD}"
        )
        print(f"  logits above the floor {scale:.2f} on average: {share * len(scores) / base:.3f} from {THRESHOLD}")
    for least in (THRESHOLD, FLOOR, 0.06):
        reported = sum(one["score"] >= least for one in detections)
        print(f"reported from {least}: {reported / images:.2f} per frame, {persons / images:.2f} persons")


if __name__ == "__main__":
    main()
