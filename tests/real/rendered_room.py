"""A frame of a room with rectangles on its walls, as a tilted ceiling camera sees it, and one without a room."""

import math
import struct
import zlib
from collections.abc import Callable

SIDE = 560
"""Pixels of the frame."""
RADIUS = 272.0
HALF_FIELD = math.radians(93)
TILT = math.radians(6)
WALLS = ((-3.1, 3.7), (-2.6, 3.2), (-0.2, 2.6))
"""The walls, the ceiling and the floor from the camera, meters."""


def rendered_room() -> bytes:
    """Returns the frame as a PNG."""
    return _image(_brightness)


def plain_disc() -> bytes:
    """Returns a frame without a room, a gray disc, as a PNG."""
    return _image(lambda x, y: 120 * (math.hypot(x - SIDE / 2, y - SIDE / 2) <= RADIUS))


def _image(brightness: Callable[[float, float], float]) -> bytes:
    """Returns a gray PNG of the mean brightness in the quarters of each pixel."""
    fine = [[brightness(x / 2 + 0.25, y / 2 + 0.25) for x in range(2 * SIDE)] for y in range(2 * SIDE)]
    rows = bytearray()
    for upper, lower in zip(fine[::2], fine[1::2], strict=True):
        rows.append(0)
        rows += bytes(int(sum(part) / 4) for part in zip(upper[::2], upper[1::2], lower[::2], lower[1::2], strict=True))
    header = struct.pack(">IIBBBBB", SIDE, SIDE, 8, 0, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(bytes(rows), 6)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def _brightness(x: float, y: float) -> float:
    """Returns the brightness at a position of the frame."""
    x, y = x - SIDE / 2, y - SIDE / 2
    radius = math.hypot(x, y)
    if radius > RADIUS:
        return 0
    theta = radius / RADIUS * HALF_FIELD
    flat = math.sin(theta) / max(radius, 1e-9)
    across, forward, down = x * flat, y * flat, math.cos(theta)
    down, across = down * math.cos(TILT) + across * math.sin(TILT), across * math.cos(TILT) - down * math.sin(TILT)
    ray = (across * 0.94 - forward * 0.342, across * 0.342 + forward * 0.94, down)
    far, axis = min(
        (walls[part > 0] / part, axis) for axis, (walls, part) in enumerate(zip(WALLS, ray, strict=True)) if part
    )
    first, second = (ray[other] * far for other in range(3) if other != axis)
    mixed = math.sin(
        math.floor(first / 0.83) * 12.9898 + math.floor(second / 0.71) * 78.233 + (2 * axis + (ray[axis] > 0)) * 37.719
    )
    return 60 + 160 * ((mixed * 43758.545) % 1)
