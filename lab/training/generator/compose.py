"""Composes a frame: a room's panorama and placed crops, seen through any lens. Numpy and OpenCV only.

Occlusion follows from the distances along the rays. The frame is composed with `SUPERSAMPLING` subpixels a side and averaged.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from .geometry import nadir_angles, panorama_xy
from .scene import floor_irradiance
from .shadow import FloorShadow, sun_patches

SUPERSAMPLING = 2
DEPTH_TOLERANCE = 0.03
"""Meters by which a crop may lie behind the room and still be visible: feet on the floor."""


@dataclass
class Composition:
    """A frame before the camera's look: linear color, distance, ids, and the unoccluded pixels of every person."""

    colour: np.ndarray
    distance: np.ndarray
    ids: np.ndarray
    persons: list


def direction_grid(calibration, factor=SUPERSAMPLING):
    """World directions of the subpixels; NaN outside the lens circle."""
    x = (np.arange(calibration.width * factor, dtype=np.float32) + 0.5) / factor - 0.5
    y = (np.arange(calibration.height * factor, dtype=np.float32) + 0.5) / factor - 0.5
    return calibration.rays(*np.meshgrid(x, y)).astype(np.float32)


def fill_depth(depth, alpha):
    """Distances for partly covered edge pixels whose own ray hit nothing: those of the nearest neighbors."""
    filled = depth.copy()
    for _ in range(2):
        missing = (filled <= 0) & (alpha > 0.02)
        if not missing.any():
            break
        filled[missing] = cv2.dilate(filled, np.ones((3, 3), np.uint8))[missing]
    return filled


def remap(image, x, y, method):
    return cv2.remap(
        image,
        x.astype(np.float32),
        y.astype(np.float32),
        method,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=0,
    )


def _window(calibration, placement, crop, factor):
    """The subpixel rectangle of the frame that a crop can reach."""
    h, w = crop.alpha.shape
    v = placement.view
    edge = np.concatenate(
        [
            np.stack(np.meshgrid(np.linspace(0, w, 24), (0, h)), -1).reshape(-1, 2),
            np.stack(np.meshgrid((0, w), np.linspace(0, h, 24)), -1).reshape(-1, 2),
        ]
    )
    px, py = edge[:, 0] + v["left"], edge[:, 1] + v["top"]
    theta, phi = np.hypot(px, py) / v["focal"], np.arctan2(px, -py) + placement.azimuth
    rays = np.stack([np.sin(theta) * np.sin(phi), np.sin(theta) * np.cos(phi), -np.cos(theta)], 1)
    camera = rays @ calibration.rotation.T
    if (np.arctan2(np.hypot(camera[:, 0], camera[:, 1]), camera[:, 2]) > calibration.lens["max_theta"] + 0.9).all():
        return None
    pixels, _ = calibration.project(rays * 10 + (0, 0, calibration.height_m))
    low, high = np.floor(pixels.min(0)) - 2, np.ceil(pixels.max(0)) + 3
    if px.min() < 0 < px.max() and py.min() < 0 < py.max():
        nadir = calibration.project(np.array([[0, 0, 0.0]]))[0][0]
        low, high = np.minimum(low, nadir), np.maximum(high, nadir)
    x0, y0 = (max(0, int(v)) for v in low)
    x1, y1 = min(calibration.width, int(high[0])), min(calibration.height, int(high[1]))
    return None if x0 >= x1 or y0 >= y1 else (slice(y0 * factor, y1 * factor), slice(x0 * factor, x1 * factor))


def _sample_crop(crop, placement, theta, phi, frame_focal):
    """Color, alpha, distance and index of a crop at nadir angles and azimuths."""
    v = placement.view
    x, y = panorama_xy(theta, phi - placement.azimuth, v["focal"])
    x, y = x - v["left"], y - v["top"]
    colour, alpha = crop.colour, crop.alpha
    shrink = v["focal"] / frame_focal
    if shrink > 1.2:
        colour, alpha = (cv2.GaussianBlur(a, (0, 0), 0.4 * shrink) for a in (colour, alpha))
    depth = fill_depth(crop.depth, crop.alpha) * placement.scale
    return (
        remap(colour, x, y, cv2.INTER_LINEAR),
        remap(alpha, x, y, cv2.INTER_LINEAR),
        remap(depth, x, y, cv2.INTER_NEAREST),
        remap(crop.index, x, y, cv2.INTER_NEAREST),
    )


def _count(mask, factor):
    return int(np.count_nonzero(mask)) / factor**2


def compose(calibration, room, placements, rng=None, sun=False, factor=SUPERSAMPLING):
    """The composition of a room (`RoomFile`) and placements. `sun` needs `rng` and adds patches of hard light."""
    rays = direction_grid(calibration, factor)
    inside = np.isfinite(rays[..., 0])
    rays = np.nan_to_num(rays)
    theta, phi = nadir_angles(rays)
    about = room.about
    x, y = panorama_xy(theta, phi, about["focal"])
    x, y = x + about["nadir"], y + about["nadir"]
    inside &= theta < about["max_theta"]
    colour = remap(room.colour, x, y, cv2.INTER_LINEAR) * inside[..., None]
    distance = remap(room.depth, x, y, cv2.INTER_NEAREST) * inside
    ids = remap(room.index, x, y, cv2.INTER_NEAREST).astype(np.uint8) * inside.astype(np.uint8)
    order = sorted(placements, key=lambda p: -p.view["distance"] * p.scale)
    if order:
        colour *= FloorShadow(about, order).visible_light(rays, distance)[..., None]
    white = max(floor_irradiance(about["lights"], about["ambient"]) / math.pi, 1e-3)
    persons, number = [], 0
    frame_focal = factor * np.count_nonzero(inside.any(0)) / factor / (2 * calibration.lens["max_theta"])
    for placement in order:
        crop = placement.file.crop(placement.view_number)
        window = _window(calibration, placement, crop, factor)
        if window is None:
            continue
        part, alpha, depth, index = _sample_crop(crop, placement, theta[window], phi[window], frame_focal)
        gain = floor_irradiance(about["lights"], about["ambient"], *placement.position) / math.pi / white
        alpha = alpha * inside[window]
        visible = (depth < distance[window] + DEPTH_TOLERANCE) & (alpha > 0)
        cover = (alpha * visible)[..., None]
        tone = float(np.clip(gain * 1.15, 0.2, 3)) * (rng.uniform(0.8, 1.25) if rng is not None else 1.0)
        colour[window] = colour[window] * (1 - cover) + part * tone * visible[..., None]
        solid = visible & (alpha > 0.5)
        distance[window][solid] = depth[solid]
        whole = alpha > 0.5
        ids[window][solid] = 0
        for person in placement.file.about["persons"]:
            number += 1
            own = whole & (index == person["index"])
            ids[window][own & visible] = number
            persons.append(
                dict(
                    number=number,
                    in_crop=_count(own, factor),
                    placement=placement,
                    about=person,
                    crop_share=min(
                        1.0,
                        np.count_nonzero((crop.index == person["index"]) & (crop.alpha > 0.5))
                        / crop.view["whole"][str(person["index"])],
                    ),
                )
            )
    if sun and rng is not None:
        colour = sun_patches(rng, about, rays, distance, colour)
    return Composition(
        _average(colour, factor),
        distance[factor // 2 :: factor, factor // 2 :: factor],
        ids[factor // 2 :: factor, factor // 2 :: factor],
        persons,
    )


def _average(image, factor):
    h, w = image.shape[:2]
    return image.reshape(h // factor, factor, w // factor, factor, -1).mean((1, 3))
