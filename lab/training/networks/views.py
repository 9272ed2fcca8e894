"""Renders views of the samples as the server does, to measure activation ranges on."""

import json
from pathlib import Path

import numpy
from PIL import Image

# Elevation in radians, number of views and field of view in degrees of each ring, as in crates/lookdown-lens/src/geometry/view_plan.rs:
# the plans of the profiles fast, balanced and quality.
RINGS = (
    *((0, 1, 90), (0.8, 12, 90)),
    *((0.05, 2, 75), (0.8, 12, 90), (1.25, 10, 40)),
    *((0.05, 2, 75), (0.4, 4, 90), (0.7, 12, 75), (1.1, 18, 50), (1.25, 20, 40)),
)


def sample_views(samples: Path, size: int):
    """Every view of every sample, one after the other: float32 `[1, 3, size, size]`, RGB, 0..255."""
    for file in sorted(samples.glob("*.jpg")):
        frame = numpy.asarray(Image.open(file).convert("RGB"), numpy.float32)
        lens = json.loads((samples / "calibrations" / f"{file.stem}.json").read_text(encoding="utf-8"))["lens"]
        for elevation, count, field_of_view in RINGS:
            for azimuth in numpy.arange(count) * (2 * numpy.pi / count):
                rays = _rays(elevation, azimuth, numpy.radians(field_of_view), size)
                yield _sample(frame, *_project(lens, rays)).transpose(2, 0, 1)[None]


def _rays(elevation: float, azimuth: float, field_of_view: float, size: int) -> numpy.ndarray:
    """The ray directions of the pixels of a view, for a camera that looks straight down."""
    tilt = numpy.array(
        [[1, 0, 0], [0, numpy.cos(elevation), -numpy.sin(elevation)], [0, numpy.sin(elevation), numpy.cos(elevation)]]
    )
    spin = numpy.array(
        [[numpy.cos(azimuth), -numpy.sin(azimuth), 0], [numpy.sin(azimuth), numpy.cos(azimuth), 0], [0, 0, 1]]
    )
    along = (numpy.arange(size) - (size - 1) / 2) * (2 * numpy.tan(field_of_view / 2) / size)
    y, x = numpy.meshgrid(along, along, indexing="ij")
    return numpy.stack([x, y, numpy.ones_like(x)], axis=-1) @ (spin @ tilt).T


def _project(lens: dict, rays: numpy.ndarray) -> tuple[numpy.ndarray, numpy.ndarray]:
    """The projection of rays by an equidistant lens: columns and rows of pixel centers; NaN outside its image."""
    across = numpy.hypot(rays[..., 0], rays[..., 1])
    theta = numpy.arctan2(across, rays[..., 2])
    radius_by_across = numpy.where(theta <= lens["max_theta"], lens["focal"] * theta / across, numpy.nan)
    return lens["cx"] + rays[..., 0] * radius_by_across, lens["cy"] + rays[..., 1] * radius_by_across


def _sample(frame: numpy.ndarray, columns: numpy.ndarray, rows: numpy.ndarray) -> numpy.ndarray:
    """Bilinear samples; black outside the frame."""
    height, width = frame.shape[:2]
    inside = (columns >= 0) & (columns <= width - 1) & (rows >= 0) & (rows <= height - 1)
    columns, rows = (numpy.where(inside, positions, 0) for positions in (columns, rows))
    left, top = numpy.minimum(columns.astype(int), width - 2), numpy.minimum(rows.astype(int), height - 2)
    right_share, lower_share = (columns - left)[..., None], (rows - top)[..., None]
    upper = frame[top, left] * (1 - right_share) + frame[top, left + 1] * right_share
    lower = frame[top + 1, left] * (1 - right_share) + frame[top + 1, left + 1] * right_share
    return numpy.where(inside[..., None], upper * (1 - lower_share) + lower * lower_share, 0).astype(numpy.float32)
