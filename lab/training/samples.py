"""Training samples out of composed frames: upright perspective views, and narrow ones around a person. Numpy and OpenCV only."""

import json
import math
from pathlib import Path

import cv2
import numpy as np
from generator import pose as poses
from generator.boxes import axis_box
from generator.geometry import lens_of, pixels_of

RINGS = ((0.05, 75.0, 0.15), (0.85, 90.0, 0.45), (1.25, 45.0, 0.4))
"""Perspective views as the profiles have them: angle from straight down (radians), field of view (degrees), share."""
VIEW_MARGIN = 0.5
"""Persons are followed this far beyond each border of a view, in its width, to know how much of them it cuts off."""
OUTSIDE = -1e4
"""A column and row outside of every frame."""
NEAR_NADIR = 0.25
"""Angle from straight down, radians, within which a crop has no upright direction."""
FILL = (0.22, 0.75)
"""The share of a crop's side that its person fills."""
STANDING_SHARE = 0.2
"""How often a person who is not on the floor is a place to look at, where those on the floor are learned."""
FAR_DEG = 68
"""Angle from straight down beyond which no view looks for people on the floor: 6 m from a camera 2.5 m above them."""
LYING, LOW = 1, 2
POSTURES = dict.fromkeys(poses.LYING, LYING) | dict.fromkeys((*poses.LOW, "crouching"), LOW)
"""The postures on the floor by pose; 0 for all others."""


def kept(moved, ignore, size):
    """Boxes of a sample, clipped to it, ignore flags, and which are kept. Scraps are ignored, and less than those dropped."""
    clipped = np.clip(moved, 0, size)
    area = lambda b: np.clip(b[:, 2] - b[:, 0], 0, None) * np.clip(b[:, 3] - b[:, 1], 0, None)
    left = area(clipped) / np.maximum(area(moved), 1e-6)
    sides = np.minimum(clipped[:, 2] - clipped[:, 0], clipped[:, 3] - clipped[:, 1])
    keep = (left > 0.05) & (sides > 1)
    return clipped[keep].astype(np.float32), (ignore | (left < 0.5) | (sides < 5))[keep], keep


def varied(image, rng):
    """Small changes of color and of sharpness; a quarter is gray with noise, as at night."""
    out = image.astype(np.float32) * rng.uniform(0.75, 1.3) + rng.uniform(-18, 18)
    if rng.random() < 0.25:
        noise = rng.normal(size=(*out.shape[:2], 1)) * rng.uniform(0, 8)
        out = np.repeat(out.mean(2, keepdims=True) + noise, 3, 2)
    out = out * rng.uniform(0.93, 1.07, 3)
    if rng.random() < 0.15:
        out = cv2.GaussianBlur(out, (0, 0), rng.uniform(0.4, 1.2))
    return np.clip(out, 0, 255).astype(np.uint8)


def ring_axes(up):
    """The world's down in the camera, and the two directions across it at azimuth 0 and at a quarter turn."""
    down = -np.asarray(up, float)
    across = np.cross(down, [1.0, 0, 0] if abs(down[0]) < 0.9 else [0, 1.0, 0])
    across /= np.linalg.norm(across)
    return down, across, np.cross(down, across)


def view_rays(up, theta, phi, field_of_view, roll, size, margin):
    """Rays in the camera of the pixels of an upright perspective view, as an array of rows × columns × 3.

    `up`: the world's up in the camera. The view looks `theta` away from straight down, at azimuth `phi`; angles in radians.
    The array reaches `margin` pixels beyond each border.
    """
    down, across, along = ring_axes(up)
    outward = math.cos(phi) * across + math.sin(phi) * along
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


def ray_at(native_lens, x, y):
    """The direction in the camera of a pixel."""
    lens = lens_of(native_lens)
    azimuth, theta = math.atan2(y - lens["cy"], x - lens["cx"]), np.linspace(0, lens["max_theta"], 400)
    rays = np.stack([np.sin(theta) * math.cos(azimuth), np.sin(theta) * math.sin(azimuth), np.cos(theta)], -1)
    columns, rows, _ = pixels_of(lens, lens["cx"], lens["cy"], rays)
    radii = np.hypot(columns - lens["cx"], rows - lens["cy"])
    at = np.interp(math.hypot(x - lens["cx"], y - lens["cy"]), radii, theta)
    return np.array([math.sin(at) * math.cos(azimuth), math.sin(at) * math.sin(azimuth), math.cos(at)])


class Frames:
    """The composed frames of one split."""

    def __init__(self, folder):
        self.folder = Path(folder)
        data = json.loads((self.folder / "annotations.json").read_text())
        self.images = data["images"]
        self.annotations = {image["id"]: [] for image in self.images}
        for a in data["annotations"]:
            self.annotations[a["image_id"]].append(a)

    def calibration(self, k):
        """The native calibration of frame `k`."""
        return json.loads((self.folder / "calibrations" / f"{self.images[k]['calibration']}.json").read_text())

    def view(self, k, size, theta, phi, field_of_view, roll=0.0):
        """An upright perspective view of frame `k`: image (size × size × 3), boxes, ignore flags, postures. Angles in radians."""
        about, native = self.images[k], self.calibration(k)
        margin = round(VIEW_MARGIN * size)
        rays = view_rays(native["mount"]["world_up"], theta, phi, field_of_view, roll, size, margin)
        columns, rows = frame_maps(rays, native["lens"])
        mask = cv2.imread(str(self.folder / about["id_mask"]), cv2.IMREAD_UNCHANGED)
        ids = cv2.remap(mask, columns, rows, cv2.INTER_NEAREST)
        inner = slice(margin, margin + size)
        frame = cv2.imread(str(self.folder / "images" / about["file_name"]))
        image = cv2.remap(frame, columns[inner, inner], rows[inner, inner], cv2.INTER_LINEAR)
        found = [(axis_box(ids == a["id_value"]), a) for a in self.annotations[about["id"]]]
        found = [(box, a) for box, a in found if box]
        boxes = np.array([box for box, _ in found], float).reshape(-1, 4)
        boxes[:, 2:] += boxes[:, :2]
        boxes, ignore, keep = kept(boxes - margin, np.array([a["ignore"] for _, a in found], bool), size)
        postures = np.array([POSTURES.get(a["pose"], 0) for _, a in found], np.int8)[keep]
        return cv2.cvtColor(image, cv2.COLOR_BGR2RGB), boxes, ignore, postures

    def places(self, k, rng, floor):
        """The boxes of frame `k` that a view may look at."""
        seen = [a for a in self.annotations[self.images[k]["id"]] if not a["ignore"]]
        is_near = lambda a: a["nadir_deg"] < FAR_DEG and (a["pose"] in POSTURES or rng.random() < STANDING_SHARE)
        wanted = lambda a: not floor or is_near(a)
        return [a["bbox"] for a in seen if wanted(a)]

    def sample(self, rng, size, crops, aimed=0.0, floor=False):
        """One random sample: image (size × size × 3), boxes, ignore flags, postures.

        A share of `crops` lies closely around a place, and the share `aimed` has it in a view as the profiles have them.
        With `floor`, most places are people on the floor.
        """
        k, which, roll = int(rng.integers(len(self.images))), rng.random(), rng.normal() * 0.04
        places = self.places(k, rng, floor) if which < crops + aimed else []
        if not places:
            theta, field_of_view, _ = RINGS[rng.choice(len(RINGS), p=[share for _, _, share in RINGS])]
            theta, phi = theta + rng.normal() * 0.1, rng.uniform(0, 2 * math.pi)
            field_of_view = math.radians(field_of_view * rng.uniform(0.85, 1.15))
            return self.view(k, size, theta, phi, field_of_view, roll)
        x, y, width, height = places[int(rng.integers(len(places)))]
        native = self.calibration(k)
        ray = ray_at(native["lens"], x + width / 2, y + height / 2)
        down, across, along = ring_axes(native["mount"]["world_up"])
        at, phi = math.acos(np.clip(ray @ down, -1, 1)), math.atan2(ray @ along, ray @ across)
        if which < crops:
            corners = [ray_at(native["lens"], x, y), ray_at(native["lens"], x + width, y + height)]
            fill = math.exp(rng.uniform(*np.log(FILL)))
            field_of_view = float(np.clip(math.acos(np.clip(corners[0] @ corners[1], -1, 1)) / fill, 0.12, 1.5))
            theta, aside = at + rng.normal() * 0.12 * field_of_view, 0.12
            roll = rng.uniform(0, 2 * math.pi) if at < NEAR_NADIR else 2 * roll
        else:
            theta, field_of_view, _ = min(RINGS, key=lambda ring: abs(ring[0] - at) + rng.uniform(0, 0.5))
            theta, aside = theta + rng.normal() * 0.1, 0.35
            field_of_view = math.radians(field_of_view * rng.uniform(0.85, 1.15))
        phi += rng.normal() * aside * field_of_view / max(0.3, math.sin(at))
        return self.view(k, size, theta, phi, field_of_view, roll)


class EmptyFrames(Frames):
    """Frames without people, all of whose cells are negatives. Views look at what is taken for a person."""

    def __init__(self, folder):
        super().__init__(folder)
        if any(self.annotations.values()):
            raise SystemExit(f"{folder} has people; --empty takes frames of `make.py empty`")
        data = json.loads((self.folder / "annotations.json").read_text())
        self.looked_at = {image["id"]: [] for image in self.images}
        for place in data["distractors"]:
            self.looked_at[place["image_id"]].append(place["bbox"])

    def places(self, k, rng, floor):
        return self.looked_at[self.images[k]["id"]]


class Mixed:
    """Samples of frames without people in `share` of the draws, and of frames with people in the others."""

    def __init__(self, people, empty, share):
        self.people, self.empty, self.share = people, empty, share

    def sample(self, rng, size, *how):
        source = self.empty if rng.random() < self.share else self.people
        return source.sample(rng, size, *how)
