"""Shadows of persons on the floor, and patches of sun, from the distances of a composed frame. Numpy and OpenCV only."""

import math

import cv2
import numpy as np

CELL = 0.05
"""Side of a cell of the floor map in meters."""


class FloorShadow:
    """A map of the floor that holds the share of light that the placed pieces leave."""

    def __init__(self, room, placements):
        (cx, cy), (width, depth) = room["centre"], room["size"]
        self.x0, self.y0 = cx - width / 2, cy - depth / 2
        self.height = room["camera_height"]
        shape = (int(depth / CELL) + 2, int(width / CELL) + 2)
        self.light = np.ones(shape, np.float32)
        for placement in placements:
            points = placement.to_world(placement.file.cloud())
            self._add(points, room)

    def _cover(self, points, blur):
        """The share of each cell that projected points cover."""
        image = np.zeros_like(self.light)
        column, row = ((points[:, i] - o) / CELL for i, o in ((0, self.x0), (1, self.y0)))
        ok = (column >= 0) & (row >= 0) & (column < image.shape[1] - 1) & (row < image.shape[0] - 1)
        if not ok.any():
            return None
        c, r = column[ok].astype(int), row[ok].astype(int)
        pad = int(3 * blur / CELL) + 3
        x0, x1, y0, y1 = max(0, c.min() - pad), c.max() + pad + 1, max(0, r.min() - pad), r.max() + pad + 1
        part = image[y0:y1, x0:x1]
        part[r - y0, c - x0] = 1
        part = cv2.dilate(part, np.ones((3, 3), np.uint8))
        return (slice(y0, y0 + part.shape[0]), slice(x0, x0 + part.shape[1])), cv2.GaussianBlur(
            part, (0, 0), max(blur / CELL, 0.6)
        )

    def _darken(self, cover, share):
        if cover is not None:
            self.light[cover[0]] *= 1 - share * np.clip(cover[1] * 1.3, 0, 1)

    def _add(self, points, room):
        centre = points[:, :2].mean(0)
        lights = [
            (lx, ly, lz, p / math.pi * (lz**2 / r2) / r2)
            for lx, ly, lz, p in room["lights"]
            if (r2 := (lx - centre[0]) ** 2 + (ly - centre[1]) ** 2 + lz**2) < 200
        ]
        total = sum(light[3] for light in lights) + math.pi * room["ambient"]
        for lx, ly, lz, strength in sorted(lights, key=lambda light: -light[3])[:3]:
            low = points[points[:, 2] < 0.95 * lz]
            t = (lz / (lz - low[:, 2]))[:, None]
            self._darken(self._cover(np.array([lx, ly]) + (low[:, :2] - (lx, ly)) * t, 0.1), 0.85 * strength / total)
        self._darken(self._cover(points[points[:, 2] < 0.35], 0.08), 0.35)
        self._darken(self._cover(points, 0.25), 0.5 * math.pi * room["ambient"] / total)

    def visible_light(self, rays, distance):
        """The share of light at each pixel: below 1 on shaded floor, 1 elsewhere."""
        x, y, z = (rays[..., i] * distance for i in range(3))
        floor = (z + self.height) < 0.06
        share = cv2.remap(
            self.light,
            ((x - self.x0) / CELL).astype(np.float32),
            ((y - self.y0) / CELL).astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=1.0,
        )
        return np.where(floor, share, 1.0)


def sun_patches(rng, room, rays, distance, colour):
    """Brightens what a low sun reaches through windows: a point is lit where the ray toward the sun leaves by a window."""
    bearing, height = rng.uniform(0, 2 * math.pi), math.radians(rng.uniform(18, 60))
    sun = np.array(
        [math.cos(bearing) * math.cos(height), math.sin(bearing) * math.cos(height), math.sin(height)],
        np.float32,
    )
    (cx, cy), (width, depth) = room["centre"], room["size"]
    side, half, across = (0, width / 2, 1) if abs(sun[0]) * depth > abs(sun[1]) * width else (1, depth / 2, 0)
    centre = (cx, cy)
    point = rays * distance[..., None] + np.array([0, 0, room["camera_height"]], np.float32)
    t = (centre[side] + math.copysign(half, sun[side]) - point[..., side]) / sun[side]
    along, up = point[..., across] + t * sun[across] - centre[across], point[..., 2] + t * sun[2]
    pitch, width_share = rng.uniform(1.5, 3.5), rng.uniform(0.4, 0.85)
    low, high = rng.uniform(0.3, 1.0), rng.uniform(1.8, max(2.2, room["ceiling"]))
    lit = ((along / pitch) % 1 < width_share) & (up > low) & (up < high) & (distance > 0) & (t > 0.05)
    lit = cv2.GaussianBlur(lit.astype(np.float32), (0, 0), 1.2)
    warm = np.array([1.0, rng.uniform(0.85, 1.0), rng.uniform(0.65, 0.95)], np.float32)
    return colour * (1 + lit[..., None] * rng.uniform(2, 7) * warm)
