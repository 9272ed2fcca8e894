"""Scores the tracks and counts of simulated walks: `score.py [--seeds 101 102 ...] [--detectors rendered photographs]`.

Each run of `cargo run -p lookdown-simulate` writes truth, detections and tracks. ByteTrack in pixel
space (package `trackers`) gets the same detections. TrackEval computes HOTA, IDF1 and MOTA.
"""

import argparse
import json
import subprocess
import sys
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import supervision as sv
from trackers import ByteTrackTracker
from trackeval.metrics import CLEAR, HOTA, Identity

ROOT = Path(__file__).resolve().parents[3]
RATES = (1, 2, 5, 10)
# Persons farther apart than this on the floor are not the same, meters: a similarity of one half.
FLOOR_MATCH_M = 1.0
# A counted crossing belongs to a true one within this time, seconds.
CROSSING_S = 3.0


def simulate(binary, **options):
    """The frames of one run and its crossings."""
    arguments = [binary]
    for name, value in options.items():
        if value is True:
            arguments.append(f"--{name}")
        elif value is not False:
            arguments += [f"--{name}", str(value)]
    lines = subprocess.run(arguments, check=True, capture_output=True, text=True).stdout.splitlines()
    rows = [json.loads(line) for line in lines]
    return rows[:-1], rows[-1]


def byte_track(frames, rate, thresholds):
    """The track of each detection, frame by frame, by ByteTrack in pixel space: (track, index of the detection)."""
    tracker = ByteTrackTracker(frame_rate=rate, **thresholds)
    rows = []
    for frame in frames:
        boxes = np.array([person["box"] for person in frame["persons"]], float).reshape(-1, 4)
        scores = np.array([person["score"] for person in frame["persons"]], float)
        detections = sv.Detections(xyxy=boxes, confidence=scores, data={"index": np.arange(len(boxes))})
        tracked = tracker.update(detections, timestamp=frame["at_s"])
        pairs = zip(tracked.tracker_id, tracked.data.get("index", []), strict=True) if len(tracked) else []
        rows.append([(int(track), int(index)) for track, index in pairs if track >= 0])
    return rows


def overlap(truth, found):
    """The intersection over union of each two boxes."""
    truth, found = np.reshape(truth, (-1, 1, 4)), np.reshape(found, (1, -1, 4))
    size = np.clip(np.minimum(truth[..., 2:], found[..., 2:]) - np.maximum(truth[..., :2], found[..., :2]), 0, None)
    both = size.prod(-1)
    areas = [(boxes[..., 2:] - boxes[..., :2]).prod(-1) for boxes in (truth, found)]
    return both / (areas[0] + areas[1] - both)


def nearness(truth, found):
    """1 for the same place on the floor, one half at the distance at which persons are not the same."""
    truth, found = np.reshape(truth, (-1, 1, 2)), np.reshape(found, (1, -1, 2))
    distance = np.linalg.norm(truth - found, axis=-1)
    return np.clip(1 - distance / (2 * FLOOR_MATCH_M), 0, 1)


def scores(frames):
    """HOTA, IDF1 and MOTA of frames of (true identifiers, found identifiers, similarity)."""
    numbers = [{}, {}]
    data = {"gt_ids": [], "tracker_ids": [], "similarity_scores": [], "num_timesteps": len(frames)}
    for true_ids, found_ids, similarity in frames:
        for key, ids, known in zip(("gt_ids", "tracker_ids"), (true_ids, found_ids), numbers, strict=True):
            data[key].append(np.array([known.setdefault(one, len(known)) for one in ids], int))
        data["similarity_scores"].append(similarity)
    for key, ids, known in zip(("gt", "tracker"), ("gt_ids", "tracker_ids"), numbers, strict=True):
        data[f"num_{key}_ids"] = len(known)
        data[f"num_{key}_dets"] = sum(map(len, data[ids]))
    quiet = {"PRINT_CONFIG": False}
    clear = CLEAR(quiet).eval_sequence(data)
    return {
        "HOTA": float(np.mean(HOTA().eval_sequence(data)["HOTA"])),
        "IDF1": float(Identity(quiet).eval_sequence(data)["IDF1"]),
        "MOTA": float(clear["MOTA"]),
        "switches": int(clear["IDSW"]),
    }


def with_persons_off(frames):
    """The scores, and the mean difference of the numbers of persons and tracks: in sum, and without its sign."""
    difference = [len(found_ids) - len(true_ids) for true_ids, found_ids, _ in frames]
    return scores(frames) | {"persons": float(np.mean(np.abs(difference))), "more": float(np.mean(difference))}


def box_scores(frames, matches):
    """Scores of tracks given as (track, index of the detection) of each frame, on the detections' boxes."""
    rows = []
    for frame, pairs in zip(frames, matches, strict=True):
        truth = [person["box"] for person in frame["truth"]]
        found = [frame["persons"][index]["box"] for _, index in pairs]
        rows.append(([p["id"] for p in frame["truth"]], [track for track, _ in pairs], overlap(truth, found)))
    return with_persons_off(rows)


def floor_scores(frames, places):
    """Scores of tracks given as (track, x, y) of each frame, on the floor."""
    rows = []
    for frame, tracks in zip(frames, places, strict=True):
        everyone = frame["everyone"]
        near = nearness([p[1:] for p in everyone], [t[1:] for t in tracks])
        rows.append(([p[0] for p in everyone], [t[0] for t in tracks], near))
    return with_persons_off(rows)


def line_crossings(frames, matches, line_x, band):
    """Crossings of tracks in pixel space over the floor line, by the same rule: beyond the band on both sides."""
    sides, crossings = {}, []
    for frame, pairs in zip(frames, matches, strict=True):
        for track, index in pairs:
            floor = frame["persons"][index]["floor"]
            if floor is None or abs(floor[0] - line_x) < band:
                continue
            side = "in" if floor[0] < line_x else "out"
            if sides.get(track, side) != side:
                crossings.append((side, frame["at_s"]))
            sides[track] = side
    return crossings


def crossing_errors(truth, found):
    """True crossings, error of the totals, and crossings that are missed or invented."""
    total = wrong = 0
    for direction in ("in", "out"):
        true_s = sorted(at_s for side, at_s in truth if side == direction)
        found_s = sorted(at_s for side, at_s in found if side == direction)
        total += abs(len(true_s) - len(found_s))
        matched = 0
        for at_s in true_s:
            near = [other for other in found_s if abs(other - at_s) <= CROSSING_S]
            if near:
                found_s.remove(min(near, key=lambda other: abs(other - at_s)))
                matched += 1
        wrong += len(true_s) - matched + len(found_s)
    return {"crossings": len(truth), "total": total, "wrong": wrong}


def single_camera(binary, rate, seed, detector, options, thresholds):
    """Figures of one camera: ours on the floor, ours in bearing space, and ByteTrack."""
    frames, counts = simulate(binary, rate=rate, seed=seed, detector=detector, **options)
    byte = byte_track(frames, rate, thresholds)
    line = counts["line_x_m"], counts["band_m"]
    found = {
        "floor": ([f["floor"] for f in frames], counts["floor"]),
        "bearing": ([f["bearing"] for f in frames], counts["bearing"]),
        "byte_track": (byte, line_crossings(frames, byte, *line)),
    }
    return {
        name: box_scores(frames, matches) | crossing_errors(counts["truth"], crossings)
        for name, (matches, crossings) in found.items()
    }


def site(binary, rate, seed, detector, options):
    """Figures of two cameras over one hall: merged, and each camera by itself."""
    frames, counts = simulate(binary, rate=rate, seed=seed, detector=detector, site=True, **options)
    apart = [[[f"{n}:{t[0]}", *t[1:]] for n, ts in enumerate(f["separate"]) for t in ts] for f in frames]
    found = {"merged": [f["merged"] for f in frames], "separate": apart}
    crossings = {"merged": counts["floor"], "separate": counts["separate"]}
    return {
        name: floor_scores(frames, places) | crossing_errors(counts["truth"], crossings[name])
        for name, places in found.items()
    }


def summary(results):
    """Means over the seeds; crossing errors per 100 true crossings."""
    rows = {}
    for name in results[0]:
        runs = [result[name] for result in results]
        row = {key: np.mean([run[key] for run in runs]) for key in runs[0]}
        row["IDF1 worst"] = min(run["IDF1"] for run in runs)
        crossings = sum(run["crossings"] for run in runs)
        for key in ("total", "wrong"):
            row[key] = 100 * sum(run[key] for run in runs) / max(crossings, 1)
        row["crossings"] = crossings
        rows[name] = row
    return rows


def main():
    """Prints a Markdown table row for each detector, rate and tracker."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default=ROOT / "target/debug/simulate")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(101, 107)))
    parser.add_argument("--rates", type=float, nargs="+", default=RATES)
    parser.add_argument("--detectors", nargs="+", default=["rendered", "photographs"])
    parser.add_argument("--persons", type=int, default=8)
    parser.add_argument("--seconds", type=int, default=240)
    parser.add_argument("--settings", default="{}", help="settings of our tracker as JSON")
    parser.add_argument("--activation", type=float, default=0.85, help="ByteTrack: least score of a new track")
    parser.add_argument("--high", type=float, default=0.7, help="ByteTrack: least score of the first stage")
    parser.add_argument("--least-overlap", type=float, default=0.05, help="ByteTrack: least overlap")
    parser.add_argument("--consecutive", type=int, default=2, help="ByteTrack: frames before a track counts")
    parser.add_argument("--lost", type=int, default=60, help="ByteTrack: frames of 1/30 s before a track ends")
    parser.add_argument("--follow", action="store_true", help="search the whole frame about once a second")
    parser.add_argument("--scenes", nargs="+", default=["camera", "site"])
    given = parser.parse_args()
    thresholds = {
        "track_activation_threshold": given.activation,
        "high_conf_det_threshold": given.high,
        "minimum_iou_threshold": given.least_overlap,
        "minimum_consecutive_frames": given.consecutive,
        "lost_track_buffer": given.lost,
    }
    options = {"persons": given.persons, "seconds": given.seconds, "settings": given.settings, "follow": given.follow}
    header = ["scene", "detector", "frames/s", "tracks", "HOTA", "IDF1", "worst", "MOTA", "switches"]
    header += ["persons off", "more", "crossings", "% totals", "% each"]
    print("| " + " | ".join(header) + " |\n" + "|---" * len(header) + "|")
    jobs = defaultdict(list)
    with ProcessPoolExecutor(2) as pool:
        for scene in given.scenes:
            for detector in given.detectors:
                for rate in given.rates:
                    for seed in given.seeds:
                        common = (given.binary, rate, seed, detector, options)
                        job = pool.submit(single_camera, *common, thresholds) if scene == "camera" else None
                        jobs[scene, detector, rate].append(job or pool.submit(site, *common))
        for (scene, detector, rate), runs in jobs.items():
            for name, row in summary([run.result() for run in runs]).items():
                cells = [scene, detector, rate, name, f"{row['HOTA']:.3f}", f"{row['IDF1']:.3f}"]
                cells += [f"{row['IDF1 worst']:.3f}", f"{row['MOTA']:.3f}", f"{row['switches']:.1f}"]
                cells += [f"{row['persons']:.2f}", f"{row['more']:+.2f}", int(row["crossings"])]
                cells += [f"{row['total']:.1f}", f"{row['wrong']:.1f}"]
                print("| " + " | ".join(map(str, cells)) + " |")
                sys.stdout.flush()


if __name__ == "__main__":
    main()
