"""Chooses crops for a room and places them on its floor without collisions. Numpy only."""

import math
from dataclasses import dataclass

import numpy as np

from .plan import is_within

LARGEST_SCALE = 1.09
"""A crop serves camera heights up to this factor away: the person is so much taller or shorter."""


NEAREST = 24
"""Crops to choose from: those with the nadir angles nearest to the wanted one."""


def random_angle(rng):
    """A nadir angle in degrees as in real images of large rooms: median 60°, out to 85°."""
    return rng.uniform(0, 85) if rng.random() < 0.2 else float(np.clip(rng.normal(63, 13), 5, 85))


@dataclass
class Placement:
    file: object
    view_number: int
    azimuth: float
    scale: float

    @property
    def view(self):
        return self.file.views[self.view_number]

    @property
    def position(self):
        distance = self.view["distance"] * self.scale
        return distance * math.sin(self.azimuth), distance * math.cos(self.azimuth)

    def to_world(self, points):
        """Points about the piece's center (meters, unscaled) as world points of this placement."""
        b, a, d = self.view["bearing"], self.azimuth, self.view["distance"]
        x = math.cos(b) * points[:, 0] + math.sin(b) * points[:, 1]
        y = -math.sin(b) * points[:, 0] + math.cos(b) * points[:, 1] + d
        return (
            np.stack([x * math.cos(a) + y * math.sin(a), -x * math.sin(a) + y * math.cos(a), points[:, 2]], 1)
            * self.scale
        )


def free(room, x, y, margin):
    """True where a disc of radius `margin` on the floor lies inside the room and clear of its furniture."""
    (cx, cy), (width, depth) = room["centre"], room["size"]
    if abs(x - cx) > width / 2 - margin - 0.1 or abs(y - cy) > depth / 2 - margin - 0.1:
        return False
    return not any(is_within(block, x, y, margin) for block in room["occupied"])


def place(rng, room, files, wanted, prefer_light=None):
    """Placements with about `wanted` persons. Each file is used at most twice in a frame, more often in a crowd."""
    tries, most_uses = max(400, 20 * wanted), 2 + wanted // 30
    fits = [
        (f, k)
        for f in files
        for k, v in enumerate(f.views)
        if abs(math.log(room["camera_height"] / v["camera_height"])) < math.log(LARGEST_SCALE)
    ]
    if prefer_light is not None:
        chosen = [(f, k) for f, k in fits if f.views[k]["light"] == prefer_light]
        fits = chosen * 4 + fits if len(chosen) > 3 else fits
    angles = np.array([math.degrees(math.atan2(f.views[k]["distance"], f.views[k]["camera_height"])) for f, k in fits])
    placed, taken, used, persons = [], [], {}, 0
    for _ in range(tries if fits else 0):
        if persons >= wanted:
            break
        off = np.abs(angles - random_angle(rng))
        file, k = fits[rng.choice(np.argsort(off)[:NEAREST])]
        if used.get(id(file), 0) >= most_uses or persons + len(file.about["persons"]) > wanted + 3:
            continue
        azimuth = float(rng.uniform(0, 2 * math.pi))
        if taken and rng.random() < 0.3:  # Near another one: people stand in groups and occlude.
            azimuth = math.atan2(taken[-1][0], taken[-1][1]) + float(rng.normal() * 0.25)
        candidate = Placement(file, k, azimuth, room["camera_height"] / file.views[k]["camera_height"])
        x, y = candidate.position
        reach = file.about["reach"] * candidate.scale
        if not free(room, x, y, min(reach * 0.75, 0.9)):
            continue
        if any(math.hypot(x - a, y - b) < 0.75 * (reach + other) for a, b, other in taken):
            continue
        placed.append(candidate)
        taken.append((x, y, reach))
        used[id(file)] = used.get(id(file), 0) + 1
        persons += len(file.about["persons"])
    return placed
