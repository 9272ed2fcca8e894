"""Training samples out of composed frames: quarter-turn tiles, crops, and upright perspective views. Numpy and OpenCV only.

A frame is turned by a multiple of 90°, so that axis-parallel boxes stay exact; persons who then stand farther than
`UPRIGHT_LIMIT` from upright are ignored, since another turn has them upright.
"""

import json
import math
from pathlib import Path

import cv2
import numpy as np
from generator.boxes import axis_box
from generator.geometry import circle_radius, lens_of, pixels_of

UPRIGHT_LIMIT = 62.0
"""Degrees between a person's foot-to-head direction and the sample's up."""
BELOW_CAMERA = 12.0
"""Degrees from straight down within which a person has no upright direction and counts in every turn."""
TILE_WIDTH = 1.5
"""Side of a tile in radii of the lens circle: from the rim down to half a radius beyond the center."""

RINGS = ((0.05, 75.0, 0.15), (0.85, 90.0, 0.45), (1.25, 45.0, 0.4))
"""Perspective views as the profiles have them: angle from straight down (radians), field of view (degrees), share."""
VIEW_MARGIN = 0.5
"""Persons are followed this far beyond each border of a view, in its width, to know how much of them it cuts off."""
OUTSIDE = -1e4
"""A column and row outside of every frame."""


def turned(width, height, boxes, angles, quarter):
    """Boxes (x0, y0, x1, y1) and upright angles in an image turned by `quarter` · 90° counter-clockwise, and its size."""
    boxes, angles = boxes.copy(), (np.asarray(angles, float) - 90 * quarter + 180) % 360 - 180
    for _ in range(quarter % 4):
        boxes = np.stack([boxes[:, 1], width - boxes[:, 2], boxes[:, 3], width - boxes[:, 0]], 1)
        width, height = height, width
    return width, height, boxes, angles


def cut(image, boxes, ignore, x, y, scale, size):
    """The square sample at (x, y) with `scale` sample pixels an image pixel. Boxes are clipped; scraps are ignored."""
    matrix = np.array([[scale, 0, -x * scale + 0.5 * scale - 0.5], [0, scale, -y * scale + 0.5 * scale - 0.5]])
    source = cv2.GaussianBlur(image, (0, 0), 0.45 / scale) if scale < 0.75 else image
    sample = cv2.warpAffine(source, matrix, (size, size), flags=cv2.INTER_LINEAR, borderValue=(0, 0, 0))
    return sample, *kept((boxes - (x, y, x, y)) * scale, ignore, size)


def kept(moved, ignore, size):
    """Boxes of a sample, clipped to it, and ignore flags. Scraps are ignored, and less than those dropped."""
    clipped = np.clip(moved, 0, size)
    area = lambda b: np.clip(b[:, 2] - b[:, 0], 0, None) * np.clip(b[:, 3] - b[:, 1], 0, None)
    left = area(clipped) / np.maximum(area(moved), 1e-6)
    sides = np.minimum(clipped[:, 2] - clipped[:, 0], clipped[:, 3] - clipped[:, 1])
    keep = (left > 0.05) & (sides > 1)
    return clipped[keep].astype(np.float32), (ignore | (left < 0.5) | (sides < 5))[keep]


def jitter(image, rng):
    """Small changes of color."""
    out = image.astype(np.float32) * rng.uniform(0.75, 1.3) + rng.uniform(-18, 18)
    if rng.random() < 0.15:
        out = np.repeat(out.mean(2, keepdims=True), 3, 2)
    return np.clip(out * rng.uniform(0.93, 1.07, 3), 0, 255).astype(np.uint8)


def varied(image, boxes, rng):
    """A square sample with its boxes, mirrored half of the time, with small changes of color."""
    if rng.random() < 0.5:
        image, size = image[:, ::-1], image.shape[1]
        boxes = np.stack([size - boxes[:, 2], boxes[:, 1], size - boxes[:, 0], boxes[:, 3]], 1)
    return jitter(image, rng), boxes


def view_rays(up, theta, phi, field_of_view, roll, size, margin):
    """Rays in the camera of the pixels of an upright perspective view, as an array of rows × columns × 3.

    `up`: the world's up in the camera. The view looks `theta` away from straight down, at azimuth `phi`; angles in radians.
    The array reaches `margin` pixels beyond each border.
    """
    down = -np.asarray(up, float)
    across = np.cross(down, [1.0, 0, 0] if abs(down[0]) < 0.9 else [0, 1.0, 0])
    across /= np.linalg.norm(across)
    outward = math.cos(phi) * across + math.sin(phi) * np.cross(down, across)
    ahead = math.cos(theta) * down + math.sin(theta) * outward
    below = math.sin(theta) * down - math.cos(theta) * outward
    right = np.cross(below, ahead)
    right, below = math.cos(roll) * right + math.sin(roll) * below, math.cos(roll) * below - math.sin(roll) * right
    at = (np.arange(-margin, size + margin) + 0.5 - size / 2) * (2 * math.tan(field_of_view / 2) / size)
    return ahead + at[None, :, None] * right + at[:, None, None] * below


def frame_maps(rays, native_lens):
    """Columns and rows of the frame at these rays, as cv2.remap takes them; outside the frame beyond the lens circle."""
    lens = lens_of(native_lens)
    columns, rows, theta = pixels_of(lens, lens["cx"], lens["cy"], rays)
    outside = theta > lens["max_theta"]
    return [np.where(outside, OUTSIDE, at).astype(np.float32) for at in (columns, rows)]


class Frames:
    """The composed frames of one split."""

    def __init__(self, folder):
        self.folder = Path(folder)
        data = json.loads((self.folder / "annotations.json").read_text())
        self.images = data["images"]
        self.annotations = {image["id"]: [] for image in self.images}
        for a in data["annotations"]:
            self.annotations[a["image_id"]].append(a)

    def load(self, k):
        """Image (RGB), boxes, upright angles (NaN below the camera: upright in every turn), ignore flags, circle's center and radius."""
        about = self.images[k]
        image = cv2.cvtColor(cv2.imread(str(self.folder / "images" / about["file_name"])), cv2.COLOR_BGR2RGB)
        found = self.annotations[about["id"]]
        boxes = np.array([(x, y, x + w, y + h) for x, y, w, h in (a["bbox"] for a in found)], float).reshape(-1, 4)
        lens = json.loads((self.folder / "calibrations" / f"{about['calibration']}.json").read_text())["lens"]
        radius = circle_radius(lens)
        angles = np.array([a["upright_deg"] if a["nadir_deg"] > BELOW_CAMERA else np.nan for a in found])
        return (
            image,
            boxes,
            angles,
            np.array([a["ignore"] for a in found], bool),
            (lens["cx"], lens["cy"], radius),
        )

    def view(self, k, size, theta, phi, field_of_view, roll=0.0):
        """An upright perspective view of frame `k`: image (size × size × 3), boxes, ignore flags. Angles in radians."""
        about = self.images[k]
        native = json.loads((self.folder / "calibrations" / f"{about['calibration']}.json").read_text())
        margin = round(VIEW_MARGIN * size)
        rays = view_rays(native["mount"]["world_up"], theta, phi, field_of_view, roll, size, margin)
        columns, rows = frame_maps(rays, native["lens"])
        mask = cv2.imread(str(self.folder / about["id_mask"]), cv2.IMREAD_UNCHANGED)
        ids = cv2.remap(mask, columns, rows, cv2.INTER_NEAREST)
        inner = slice(margin, margin + size)
        frame = cv2.imread(str(self.folder / "images" / about["file_name"]))
        image = cv2.remap(frame, columns[inner, inner], rows[inner, inner], cv2.INTER_LINEAR)
        found = [(axis_box(ids == a["id_value"]), a["ignore"]) for a in self.annotations[about["id"]]]
        found = [(box, ignore) for box, ignore in found if box]
        boxes = np.array([box for box, _ in found], float).reshape(-1, 4)
        boxes[:, 2:] += boxes[:, :2]
        boxes, ignore = kept(boxes - margin, np.array([ignore for _, ignore in found], bool), size)
        return cv2.cvtColor(image, cv2.COLOR_BGR2RGB), boxes, ignore

    def random_view(self, rng, size):
        """A random upright perspective view."""
        theta, field_of_view, _ = RINGS[rng.choice(len(RINGS), p=[share for _, _, share in RINGS])]
        theta, phi = theta + rng.normal() * 0.12, rng.uniform(0, 2 * math.pi)
        field_of_view = math.radians(field_of_view * rng.uniform(0.85, 1.15))
        k = int(rng.integers(len(self.images)))
        return self.view(k, size, theta, phi, field_of_view, roll=rng.normal() * 0.04)

    def sample(self, rng, size, tile_share=0.5, view_share=0.0):
        """One random sample: image (size × size × 3), boxes, ignore flags."""
        if rng.random() < view_share:
            image, boxes, ignore = self.random_view(rng, size)
        else:
            image, boxes, ignore = self.turned_sample(rng, size, tile_share)
        return *varied(image, boxes, rng), ignore

    def turned_sample(self, rng, size, tile_share):
        """A random tile or crop of a turned frame."""
        image, boxes, angles, ignore, (cx, cy, radius) = self.load(int(rng.integers(len(self.images))))
        quarter = int(rng.integers(4))
        centre = np.array([[cx, cy, cx, cy]]) + 0.5  # Boxes count from a pixel's corner.
        _, _, (*boxes, centre), angles = turned(
            image.shape[1], image.shape[0], np.concatenate([boxes, centre]), angles, quarter
        )
        boxes, (cx, cy) = np.array(boxes).reshape(-1, 4), centre[:2]
        image = np.ascontiguousarray(np.rot90(image, quarter))
        ignore = ignore | (np.abs(angles) > UPRIGHT_LIMIT)
        usable = np.flatnonzero(~ignore)
        if rng.random() < tile_share or not len(usable):
            scale = size / (TILE_WIDTH * radius) * rng.uniform(0.9, 1.15)
            x, y = (
                cx - TILE_WIDTH * radius / 2 + rng.normal() * 0.05 * radius,
                cy - radius + rng.normal() * 0.04 * radius,
            )
        else:
            x0, y0, x1, y1 = boxes[rng.choice(usable)]
            scale = size * math.exp(rng.uniform(math.log(0.12), math.log(0.7))) / max(x1 - x0, y1 - y0)
            scale = min(scale, 4.0)
            x, y = (
                (x0 + x1) / 2 - size / scale * rng.uniform(0.25, 0.75),
                (y0 + y1) / 2 - size / scale * rng.uniform(0.25, 0.75),
            )
        return cut(image, boxes, ignore, x, y, scale, size)


class EmptyFrames(Frames):
    """Frames without people, all of whose cells are negatives. Crops lie around what is taken for a person.

    `false_alarms`: COCO results of detections in these frames, for more places of crops than the annotated distractors.
    """

    def __init__(self, folder, false_alarms=None):
        super().__init__(folder)
        if any(self.annotations.values()):
            raise SystemExit(f"{folder} has people; --empty takes frames of `make.py empty`")
        data = json.loads((self.folder / "annotations.json").read_text())
        found = json.loads(Path(false_alarms).read_text()) if false_alarms else []
        self.places = {image["id"]: [] for image in self.images}
        for place in data["distractors"] + found:
            self.places[place["image_id"]].append(place["bbox"])

    def load(self, k):
        """As of frames with people, with the places of crops instead of persons."""
        image, _, _, _, (cx, cy, radius) = super().load(k)
        places = self.places[self.images[k]["id"]]
        boxes = np.array([(x, y, x + w, y + h) for x, y, w, h in places], float).reshape(-1, 4)
        return image, boxes, outward_angles(boxes, cx, cy), np.zeros(len(boxes), bool), (cx, cy, radius)

    def sample(self, rng, size, tile_share=0.5, view_share=0.0):
        image, boxes, ignore = super().sample(rng, size, tile_share, view_share)
        return image, boxes[:0], ignore[:0]


def outward_angles(boxes, cx, cy):
    """Directions from the center of the lens circle to the middles of boxes, degrees clockwise from the image's up."""
    middle = (boxes[:, :2] + boxes[:, 2:]) / 2
    return np.degrees(np.arctan2(middle[:, 0] - cx, cy - middle[:, 1]))


class Mixed:
    """Samples of frames without people in `share` of the draws, and of frames with people in the others."""

    def __init__(self, people, empty, share):
        self.people, self.empty, self.share = people, empty, share

    def sample(self, rng, size, tile_share=0.5, view_share=0.0):
        source = self.empty if rng.random() < self.share else self.people
        return source.sample(rng, size, tile_share, view_share)
