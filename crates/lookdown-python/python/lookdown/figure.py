"""A frame with its persons as a figure in a notebook: SVG over the image, without further packages."""

import base64
import os
import struct
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from lookdown import _lookdown

Source = str | os.PathLike[str] | bytes | npt.NDArray[Any]
"""A frame as `Detector.detect` takes it; an array in RGB."""
MAX_WIDTH = 720
"""Width of a figure in a page, pixels."""
STARTS = {b"\xff\xd8": "image/jpeg", b"\x89P": "image/png", b"RI": "image/webp"}


def figure(source: Source, report: dict[str, Any], corners: npt.NDArray[np.float64]) -> str:
    """Returns HTML with the frame, the oriented boxes and the scores."""
    width, height = report["image"]["width"], report["image"]["height"]
    size = max(width, height) / 60.0
    shapes = []
    for box, person in zip(corners.tolist(), report["persons"], strict=True):
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in box)
        top = min(box, key=lambda corner: float(corner[1]))
        shapes.append(f'<polygon points="{points}" fill="none"/>')
        label = f'<text x="{top[0]:.1f}" y="{top[1]:.1f}" fill="#ffc800" stroke="none">'
        shapes.append(f"{label}{person['score']:.2f}</text>")
    style = f'stroke="#ffc800" stroke-width="{size / 6:.1f}" font-family="sans-serif" font-size="{size:.1f}"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'style="width:100%;max-width:{MAX_WIDTH}px">'
        f'<image width="{width}" height="{height}" href="{data_url(source)}"/>'
        f"<g {style}>{''.join(shapes)}</g></svg>"
    )


def data_url(source: Source) -> str:
    """Returns the image as a `data:` URL."""
    if isinstance(source, np.ndarray):
        content = png(source)
    else:
        content = source if isinstance(source, bytes) else _lookdown.read_image(source)
    media_type = STARTS.get(content[:2], "application/octet-stream")
    return f"data:{media_type};base64,{base64.b64encode(content).decode()}"


def png(pixels: npt.NDArray[Any]) -> bytes:
    """Returns RGB pixels as a PNG file."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)
    rows[:, 1:] = pixels.reshape(height, 3 * width)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 1)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
