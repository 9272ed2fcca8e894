"""Readers of what was rendered: person crops and rooms, each one packed file."""

import json
from dataclasses import dataclass

import numpy as np

RADIANCE_SCALE = 4.0
"""The largest linear value stored, relative to a white surface under the same light."""


def encode_radiance(linear):
    """Linear color as 16 bits with a square-root curve: fine steps in the dark."""
    return np.rint(np.sqrt(np.clip(linear / RADIANCE_SCALE, 0, 1)) * 65535).astype(np.uint16)


def decode_radiance(stored):
    return (stored.astype(np.float32) / 65535) ** 2 * RADIANCE_SCALE


@dataclass
class Crop:
    """One view of a piece: premultiplied linear color, alpha, distance in meters, person index, and its place."""

    colour: np.ndarray
    alpha: np.ndarray
    depth: np.ndarray
    index: np.ndarray
    view: dict


class CropFile:
    """A file of persons.py. Only its description stays in memory and no file stays open: there are thousands."""

    def __init__(self, path):
        self.path = path
        with np.load(path) as arrays:
            self.about = json.loads(bytes(arrays["about"]))
        self.views = self.about["views"]

    def crop(self, k):
        with np.load(self.path) as a:
            return Crop(
                decode_radiance(a[f"colour{k}"]),
                a[f"alpha{k}"].astype(np.float32) / 255,
                a[f"depth{k}"].astype(np.float32) / 1000,
                a[f"index{k}"],
                self.views[k],
            )

    def cloud(self):
        """Points of the piece's surfaces about its center, for shadows."""
        with np.load(self.path) as arrays:
            return arrays["cloud"].astype(np.float32)


class RoomFile:
    """A file of rooms.py: one panorama of an empty room."""

    def __init__(self, path):
        with np.load(path) as arrays:
            self.about = json.loads(bytes(arrays["about"]))
            self.colour = decode_radiance(arrays["colour"])
            self.depth = arrays["depth"].astype(np.float32) / 1000
            self.index = arrays["index"]
