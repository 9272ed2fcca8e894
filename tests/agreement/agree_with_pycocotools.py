"""Compares what `lookdown eval` says of saved detections with what pycocotools says of them.

    lookdown eval DATASET --profile balanced --refine fusion --save-detections FOUND --json > ROWS
    python tests/agreement/agree_with_pycocotools.py DATASET FOUND ROWS     (needs pycocotools)

DATASET is a folder with annotations.json of axis-parallel boxes, or such a file. FOUND is a file of
COCO results, or the folder of them; ROWS has one JSON object per line. A file belongs to the row
whose profile, refinement and model make its name, and a single file to a single row. AP50, AP75
and AP50:95 at COCO's 101 recalls must agree to 1e-6.
"""

import argparse
import contextlib
import io
import json
import sys
from pathlib import Path

from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

TOLERANCE = 1e-6
# `lookdown eval` looks at every detection; pycocotools at no more than this per image.
EVERY_DETECTION = 1_000_000


def truth_of(path):
    """The truth with all that pycocotools wants of it: areas, categories and IDs from 1 on."""
    file = path / "annotations.json" if path.is_dir() else path
    data = json.loads(file.read_text())
    categories = data.get("categories") or [{"id": 1, "name": "person"}]
    named = [c["id"] for c in categories if c["name"].lower() == "person"]
    person = named[0] if named else categories[0]["id"]
    annotations = [a for a in data["annotations"] if a.get("category_id", person) == person]
    for number, annotation in enumerate(annotations, start=1):
        if len(annotation["bbox"]) != 4:
            sys.exit(f"{file}: has rotated boxes; this script compares axis-parallel ones")
        _, _, width, height = annotation["bbox"]
        annotation.update(id=number, category_id=1, area=width * height)
        annotation.setdefault("iscrowd", 0)
    truth = COCO()
    truth.dataset = {
        "images": data["images"],
        "categories": [{"id": 1, "name": "person"}],
        "annotations": annotations,
    }
    truth.createIndex()
    return truth


def average_precisions(truth, detections):
    """AP50, AP75 and AP50:95."""
    evaluation = COCOeval(truth, truth.loadRes(detections), "bbox")
    evaluation.params.maxDets = [1, 10, EVERY_DETECTION]
    evaluation.evaluate()
    evaluation.accumulate()
    # Threshold, recall, category, area range, most detections.
    precision = evaluation.eval["precision"][:, :, 0, 0, 2]
    return {
        "ap50_coco": precision[0].mean(),
        "ap75_coco": precision[5].mean(),
        "ap50_95_coco": precision.mean(),
    }


def pairs(found, rows):
    """Files of detections with their rows."""
    files = sorted(found.glob("*.json")) if found.is_dir() else [found]
    if len(files) == len(rows) == 1:
        return [(files[0], rows[0])]
    by_name = {f"{row['profile']}.{row['refine']}.{row['model']}": row for row in rows}
    strange = [file.name for file in files if file.stem not in by_name]
    if strange:
        sys.exit(f"{', '.join(strange)}: no row has this profile, refinement and model")
    return [(file, by_name[file.stem]) for file in files]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data_set", type=Path)
    parser.add_argument("found", type=Path)
    parser.add_argument("rows", type=Path)
    arguments = parser.parse_args()
    rows = [json.loads(line) for line in arguments.rows.read_text().splitlines() if line.strip()]
    with contextlib.redirect_stdout(io.StringIO()):
        truth = truth_of(arguments.data_set)
    farthest = 0.0
    compared = pairs(arguments.found, rows)
    for file, row in compared:
        detections = json.loads(file.read_text())
        if not detections:
            sys.exit(f"{file}: has no detections to compare")
        with contextlib.redirect_stdout(io.StringIO()):
            theirs = average_precisions(truth, detections)
        for name, value in theirs.items():
            apart = abs(row[name] - value)
            farthest = max(farthest, apart)
            verdict = "ok" if apart <= TOLERANCE else "DISAGREES"
            print(f"{file.stem}: {name} {row[name]:.9f}, pycocotools {value:.9f}: {verdict}")
    if not compared or farthest > TOLERANCE:
        sys.exit(f"no agreement to {TOLERANCE:g}")
    print(f"agreement to {farthest:.1e}")


if __name__ == "__main__":
    main()
