"""Writes composed frames with annotations: `WORK/frames/SPLIT/{images,ids,calibrations,records}` and `annotations.json`.

Boxes are axis-parallel and oriented, of the visible pixels. `WORK/frames/SPLIT-oriented` is the same data set with the
oriented boxes as its truth. Finished frames are skipped.
"""

import json
import math

import cv2
import numpy as np

from .boxes import person_boxes
from .compose import compose
from .crops import CropFile, RoomFile
from .geometry import Calibration, camera_rotation, make_lens
from .look import apply_look, random_look
from .placement import place
from .progress import Progress
from .scene import DISTRACTORS

SMALLEST_AREA, SMALLEST_SHARE = 40, 0.2
"""Persons with fewer visible pixels, or a smaller visible share, are marked `ignore`."""

CROWD_AREA = 150
"""Square meters from which a room may hold a crowd."""


def random_camera(rng, room):
    """A random frame size, lens, place of the circle, turn and tilt that the room's panorama can serve."""
    diameter = int(rng.choice([640, 720, 832, 960, 1080, 1200]))
    lens = make_lens(rng, diameter / 2)
    width = height = diameter + int(rng.choice([0, 8, 40]))
    if rng.random() < 0.3:
        width, height = int(diameter * 4 / 3), int(diameter * rng.choice([1.0, 1.0, 0.9]))
    all_round = room["max_theta"] > math.radians(120)
    tilt = 0.0
    if rng.random() < 0.35:
        tilt = abs(float(rng.normal() * math.radians(3)))
    if all_round and rng.random() < 0.7:
        tilt = math.radians(float(rng.uniform(5, 62)))
    rotation = camera_rotation(float(rng.uniform(0, 2 * math.pi)), tilt, float(rng.normal() * 0.02) if tilt else 0.0)
    cx, cy = ((s - 1) / 2 + float(rng.normal() * 0.004 * diameter) for s in (width, height))
    return Calibration(width, height, lens, cx, cy, rotation, room["camera_height"])


def wanted_persons(rng, room):
    """5 to 40 persons, 30 to 90 in a quarter of the large rooms, fewer in small rooms."""
    area = room["size"][0] * room["size"][1]
    low, high, each = (30, 90, 2.5) if area > CROWD_AREA and rng.random() < 0.25 else (5, 40, 5)
    return int(np.clip(np.exp(rng.uniform(math.log(low), math.log(high))), 3, max(5, area / each)))


def annotate(composition, calibration):
    """Annotations of the persons with at least one visible pixel."""
    out = []
    nadir = calibration.project(np.array([[0, 0, 0.0]]))[0][0]
    for person in composition.persons:
        centre_mask = composition.ids == person["number"]
        if not centre_mask.any():
            continue
        ys, xs = np.nonzero(centre_mask)
        upright = math.degrees(math.atan2(xs.mean() - nadir[0], nadir[1] - ys.mean()))
        boxes = person_boxes(composition.ids, person["number"], upright)
        share = min(1.0, boxes["area"] / max(person["in_crop"], 1)) * person["crop_share"]
        placement, about = person["placement"], person["about"]
        x, y = placement.to_world(np.array([[about["x"], about["y"], 0.0]]))[0][:2]
        ignore = boxes["area"] < SMALLEST_AREA or share < SMALLEST_SHARE
        out.append(
            dict(
                category_id=1,
                iscrowd=int(ignore),
                ignore=bool(ignore),
                bbox=boxes["bbox"],
                obb=[round(v, 2) for v in boxes["obb"]],
                area=boxes["area"],
                id_value=person["number"],
                visible_fraction=round(share, 3),
                upright_deg=round(upright, 2),
                nadir_deg=round(math.degrees(math.atan2(math.hypot(x, y), calibration.height_m)), 2),
                floor_xy=[round(float(x), 3), round(float(y), 3)],
                pose=about["kind"],
                child=about["child"],
                piece=placement.file.about["piece"],
                source=placement.file.about["seed"],
            )
        )
    return out


def distractors(ids):
    """Boxes of things that are easily taken for persons."""
    out = []
    for value, name in DISTRACTORS.items():
        count, labels, stats, _ = cv2.connectedComponentsWithStats((ids == value).astype(np.uint8))
        out += [
            dict(kind=name, bbox=[int(v) for v in stats[k][:4]])
            for k in range(1, count)
            if stats[k][4] >= SMALLEST_AREA
        ]
    return out


def make_frame(seed, rooms, files, folder, split):
    """Composes a frame of one of `rooms`. Without `files` of persons, the room is empty."""
    rng = np.random.default_rng(seed)
    room = RoomFile(rooms[rng.integers(len(rooms))])
    calibration = random_camera(rng, room.about)
    look = random_look(rng)
    prefer = {"infrared": "infrared"}.get(look["kind"], "sun" if look["sun"] else None)
    placements = place(rng, room.about, files, wanted_persons(rng, room.about), prefer) if files else []
    composition = compose(calibration, room, placements, rng, look["sun"])
    image = apply_look(rng, look, composition, calibration)
    name = str(seed)
    cv2.imwrite(str(folder / "images" / f"{name}.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, look["quality"]])
    cv2.imwrite(str(folder / "ids" / f"{name}.png"), composition.ids)
    (folder / "calibrations" / f"{name}.json").write_text(json.dumps(calibration.native(name), indent=1))
    record = dict(
        image=dict(
            id=seed,
            file_name=f"{name}.jpg",
            id_mask=f"ids/{name}.png",
            calibration=name,
            width=calibration.width,
            height=calibration.height,
            room=room.about["seed"],
            split=split,
            look=look,
        ),
        annotations=annotate(composition, calibration),
        distractors=distractors(composition.ids),
    )
    (folder / "records" / f"{name}.json").write_text(json.dumps(record))


def write_annotations(folder):
    """Gathers the records into one file in the manner of COCO."""
    images, annotations, others = [], [], []
    for path in sorted((folder / "records").glob("*.json")):
        record = json.loads(path.read_text())
        images.append(record["image"])
        for a in record["annotations"]:
            annotations.append(dict(a, id=len(annotations) + 1, image_id=record["image"]["id"]))
        others += [dict(d, image_id=record["image"]["id"]) for d in record["distractors"]]
    content = dict(images=images, annotations=annotations, distractors=others, categories=[dict(id=1, name="person")])
    (folder / "annotations.json").write_text(json.dumps(content))
    oriented = folder.with_name(f"{folder.name}-oriented")
    oriented.mkdir(exist_ok=True)
    for part in ("images", "calibrations"):
        if not (oriented / part).exists():
            (oriented / part).symlink_to(folder.resolve() / part)
    content["annotations"] = [dict(a, bbox=a["obb"]) for a in annotations]
    (oriented / "annotations.json").write_text(json.dumps(content))
    return len(images), len(annotations)


def make_frames(work, first_seed, count, split="train", is_empty=False):
    """Composes `count` frames, with persons or, if `is_empty`, without in `WORK/frames/SPLIT-empty`."""
    folder = work / "frames" / (f"{split}-empty" if is_empty else split)
    for part in ("images", "ids", "calibrations", "records"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    listed = lambda kind: [p for p in sorted((work / kind / split).glob("*.npz")) if "partial" not in p.name]
    rooms, files = listed("rooms"), [] if is_empty else [CropFile(p) for p in listed("persons")]
    if not rooms or not (files or is_empty):
        raise SystemExit(
            f"{work} has {len(rooms)} rooms and {len(files)} person files of the split {split}; render both first"
        )
    todo = [s for s in range(first_seed, first_seed + count) if not (folder / "records" / f"{s}.json").exists()]
    progress = Progress(f"frames {folder.name}", len(todo), work / "log" / f"frames-{folder.name}.log")
    for seed in todo:
        make_frame(seed, rooms, files, folder, split)
        progress.step()
    frame_count, person_count = write_annotations(folder)
    print(f"{frame_count} frames, {person_count} persons")
