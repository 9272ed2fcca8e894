"""From masks to boxes: axis-parallel and oriented boxes of the visible pixels. Numpy and OpenCV only.

An oriented box is [cx, cy, w, h, angle]: `angle` in degrees clockwise from upright, -90 to 90, `h` along the person.
Pixel i covers [i, i + 1), so that a mask of one pixel at (3, 5) has the box [3, 5, 1, 1] and the center (3.5, 5.5).
"""

import math

import cv2
import numpy as np


def axis_box(mask):
    """[x, y, w, h] of a mask in whole pixels, or None of an empty one."""
    columns, rows = np.flatnonzero(mask.any(0)), np.flatnonzero(mask.any(1))
    if not len(columns):
        return None
    return [int(columns[0]), int(rows[0]), int(columns[-1] - columns[0] + 1), int(rows[-1] - rows[0] + 1)]


def wrap_upright(angle):
    """An axis's angle in degrees brought into [-90, 90)."""
    return (angle + 90) % 180 - 90


def _outline(mask):
    """The centers of all outline pixels of a mask (n × 2)."""
    outlines, _ = cv2.findContours(np.ascontiguousarray(mask, np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.concatenate(outlines)[:, 0].astype(np.float32) + 0.5


def box_along(mask, angle):
    """The tightest box of a mask whose height runs along `angle`: exact at 0, half a pixel around the outermost centers at others."""
    t = math.radians(angle)
    across, along = np.array([math.cos(t), math.sin(t)]), np.array([-math.sin(t), math.cos(t)])
    points = _outline(mask)
    u, v = points @ across, points @ along
    centre = (u.min() + u.max()) / 2 * across + (v.min() + v.max()) / 2 * along
    return [
        float(centre[0]),
        float(centre[1]),
        float(np.ptp(u)) + 1,
        float(np.ptp(v)) + 1,
        wrap_upright(angle),
    ]


def oriented_box(mask, upright):
    """The smallest box of a mask at any angle; of its two axes the one nearer to the angle `upright` is the height."""
    (_, _), (_, _), angle = cv2.minAreaRect(_outline(mask))
    nearest = min((angle, angle + 90), key=lambda a: abs(wrap_upright(a - upright)))
    return box_along(mask, nearest)


def person_boxes(ids, index, upright):
    """Axis-parallel box, oriented box and area of one person in an id mask; None where no pixel is visible."""
    mask = ids == index
    box = axis_box(mask)
    if box is None:
        return None
    x, y, w, h = box
    part = mask[y : y + h, x : x + w]
    oriented = oriented_box(part, upright)
    oriented[0] += x
    oriented[1] += y
    return dict(bbox=box, obb=oriented, area=int(part.sum()))
