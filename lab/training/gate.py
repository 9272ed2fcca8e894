"""Detects persons in four quarter-turn tiles of each frame of a data set, and writes COCO results.

    python lab/training/gate.py --data DATASET --model WORK/nanodet.onnx --out before.json
    python lab/training/gate.py --data DATASET --model WORK/runs/first/averaged.onnx --out after.json
    lookdown eval DATASET --from-detections before.json
    lookdown eval DATASET --from-detections after.json

A tile shows the frame from the rim to beyond the center, turned by 0, 90, 180 or 270 degrees; of its boxes, those within 50
degrees of straight up count, so that each person counts in the turn in which it stands nearly upright.
"""

import argparse
import json
from pathlib import Path

import cv2
import numpy as np
import torch
from generator.geometry import circle_radius
from network import Network, boxes_of

from samples import TILE_WIDTH, turned

TILE_HEIGHT = 1.15
"""Height of a tile in radii of the lens circle."""
UPRIGHT_SECTOR = 50.0
"""Degrees from straight up within which the middle of a box must lie."""
CENTRE = 0.12
"""Distance from the center in radii within which boxes of every turn count."""
RIM = 1.02
LEAST_SCORE = 0.02
CUT_OFF = 0.7
"""Factor of the score of a box at a border of its tile."""
OVERLAP = 0.6
"""IoU from which the lesser of two boxes is dropped."""


def circle_of(image, folder):
    """Center and radius of the lens circle, pixels; the largest circle in the frame where the lens is unknown."""
    path = folder / "calibrations" / f"{image.get('calibration')}.json"
    if path.is_file():
        lens = json.loads(path.read_text())["lens"]
        try:
            return lens["cx"], lens["cy"], circle_radius(lens)
        except (KeyError, ValueError):
            return lens["cx"], lens["cy"], min(image["width"], image["height"]) / 2
    return (image["width"] - 1) / 2, (image["height"] - 1) / 2, min(image["width"], image["height"]) / 2


def suppressed(boxes, scores):
    """Indices of the boxes that non-maximum suppression keeps, highest score first."""
    kept, order = [], np.argsort(-scores)
    area = (boxes[:, 2:] - boxes[:, :2]).prod(1)
    while len(order):
        first, rest = order[0], order[1:]
        kept.append(first)
        low, high = np.maximum(boxes[first, :2], boxes[rest, :2]), np.minimum(boxes[first, 2:], boxes[rest, 2:])
        shared = np.clip(high - low, 0, None).prod(1)
        order = rest[shared / (area[first] + area[rest] - shared) < OVERLAP]
    return kept


def tile_boxes(network, frame, circle, width):
    """Boxes in the frame of the tile at the frame's upper side, and their scores."""
    cx, cy, radius = circle
    scale, height = width / (TILE_WIDTH * radius), int(round(width * TILE_HEIGHT / TILE_WIDTH))
    height = -(-height // 32) * 32
    left, top = cx + 0.5 - TILE_WIDTH * radius / 2, cy + 0.5 - radius
    source = cv2.GaussianBlur(frame, (0, 0), 0.45 / scale) if scale < 0.75 else frame
    matrix = np.array([[scale, 0, -left * scale + 0.5 * scale - 0.5], [0, scale, -top * scale + 0.5 * scale - 0.5]])
    tile = cv2.warpAffine(source, matrix, (width, height), flags=cv2.INTER_LINEAR, borderValue=(0, 0, 0))
    with torch.no_grad():
        logits, sides, points, strides = network(torch.from_numpy(tile).permute(2, 0, 1)[None].float())
        boxes, scores = boxes_of(sides, points, strides)[0].numpy(), logits[0].sigmoid().numpy()
    boxes, scores = boxes[scores > LEAST_SCORE], scores[scores > LEAST_SCORE]
    at_border = (boxes[:, 0] < 3) | (boxes[:, 2] > width - 3) | (boxes[:, 3] > height - 3)
    boxes = boxes / scale + (left, top, left, top)
    x, y = (boxes[:, 0] + boxes[:, 2]) / 2 - cx - 0.5, (boxes[:, 1] + boxes[:, 3]) / 2 - cy - 0.5
    distance = np.hypot(x, y) / radius
    upright = np.degrees(np.abs(np.arctan2(x, -y))) < UPRIGHT_SECTOR
    counts = (upright | (distance < CENTRE)) & (distance < RIM)
    return boxes[counts], np.where(at_border, CUT_OFF * scores, scores)[counts]


def detect(network, frame, circle, width):
    """Boxes (x0, y0, x1, y1) and scores of the persons in a frame (RGB)."""
    found = []
    for quarter in range(4):
        view, (cx, cy, radius) = frame, circle
        if quarter:
            centre = np.array([[cx + 0.5, cy + 0.5, cx + 0.5, cy + 0.5]])
            _, _, centre, _ = turned(frame.shape[1], frame.shape[0], centre, [0.0], quarter)
            cx, cy = centre[0, :2] - 0.5
            view = np.ascontiguousarray(np.rot90(frame, quarter))
        boxes, scores = tile_boxes(network, view, (cx, cy, radius), width)
        _, _, boxes, _ = turned(view.shape[1], view.shape[0], boxes, np.zeros(len(boxes)), (4 - quarter) % 4)
        found.append((boxes, scores))
    boxes, scores = (np.concatenate(part) for part in zip(*found))
    kept = suppressed(boxes, scores)[:300]
    return boxes[kept], scores[kept]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="a folder with annotations.json")
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--width", type=int, default=832, help="width of a tile, pixels")
    parser.add_argument("--threads", type=int, default=1)
    o = parser.parse_args()
    torch.set_num_threads(o.threads)
    network, results = Network(o.model), []
    images = json.loads((o.data / "annotations.json").read_text())["images"]
    for number, image in enumerate(images, 1):
        frame = cv2.cvtColor(cv2.imread(str(o.data / "images" / image["file_name"])), cv2.COLOR_BGR2RGB)
        for (x0, y0, x1, y1), score in zip(*detect(network, frame, circle_of(image, o.data), o.width)):
            box = [round(float(v), 2) for v in (x0, y0, x1 - x0, y1 - y0)]
            results.append(dict(image_id=image["id"], category_id=1, bbox=box, score=round(float(score), 5)))
        print(f"{number} of {len(images)} frames, {len(results)} boxes", flush=True)
    o.out.write_text(json.dumps(results))


if __name__ == "__main__":
    main()
