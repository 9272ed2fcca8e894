"""Compares projection with `cv2.fisheye` on the same arrays. Prints the largest differences and ns per point as JSON."""

import json
import time
from pathlib import Path

import cv2
import lookdown
import numpy as np

POINTS = 200_000
ROUNDS = 5
FOCAL, CENTER = (380.0, 381.0), (479.5, 480.25)
DISTORTION = (0.0034, 0.0007, -0.002, 0.0002)

Path("camchain.yaml").write_text(
    "cam0:\n"
    "  camera_model: pinhole\n"
    "  distortion_model: equidistant\n"
    f"  intrinsics: [{FOCAL[0]}, {FOCAL[1]}, {CENTER[0]}, {CENTER[1]}]\n"
    f"  distortion_coeffs: {list(DISTORTION)}\n"
    "  resolution: [960, 960]\n",
    encoding="utf-8",
)
lens = lookdown.Calibration.read("camchain.yaml").lens
matrix = np.array([[FOCAL[0], 0, CENTER[0]], [0, FOCAL[1], CENTER[1]], [0, 0, 1]])
distortion = np.array(DISTORTION)

random = np.random.default_rng(1)
theta = random.uniform(0.01, 1.1, POINTS)
azimuth = random.uniform(-np.pi, np.pi, POINTS)
rays = np.stack([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)], axis=1)


def timed(function):
    """Returns the result and the shortest time per point of some rounds, nanoseconds."""
    best = np.inf
    for _ in range(ROUNDS):
        started = time.perf_counter()
        result = function()
        best = min(best, time.perf_counter() - started)
    return result, round(1e9 * best / POINTS, 1)


pixels, project_ns = timed(lambda: lens.project(rays))
zero = np.zeros(3)
theirs, their_project_ns = timed(
    lambda: cv2.fisheye.projectPoints(rays[:, None], zero, zero, matrix, distortion)[0][:, 0]
)
back, unproject_ns = timed(lambda: lens.unproject(pixels))
criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12)
plane, their_unproject_ns = timed(
    lambda: cv2.fisheye.undistortPoints(pixels[:, None], matrix, distortion, criteria=criteria)[:, 0]
)
their_rays = np.column_stack([plane, np.ones(POINTS)])
their_rays /= np.linalg.norm(their_rays, axis=1, keepdims=True)
print(
    json.dumps(
        {
            "project_pixels": float(np.abs(pixels - theirs).max()),
            "unproject_radians": float(np.linalg.norm(back - their_rays, axis=1).max()),
            "ns_per_point": {
                "project": [project_ns, their_project_ns],
                "unproject": [unproject_ns, their_unproject_ns],
            },
        }
    )
)
