"""Lens models, calibrations and the panorama about the vertical that persons and rooms are rendered in. Numpy only.

World: z up, the camera at (0, 0, height). Nadir angle `theta`: 0 straight down, 90° at the horizon. Azimuth `phi`: 0 along
+y, growing toward +x. Panorama: equidistant about the nadir, `focal` pixels a radian, x right = +x, y down = -y. Every
camera at that place, however turned or tilted, is a remapping of the panorama, and turning a person about the vertical is
a rotation of the panorama. Pixel centers are integers; boxes cover whole pixels, corner-origin.
"""

import math
from dataclasses import dataclass, field

import numpy as np


def radius_of(lens, theta):
    """Distance from the principal point in pixels at an angle from the optical axis."""
    theta = np.asarray(theta, float)
    model, f = lens["model"], lens["focal"]
    if model == "equidistant":
        return f * theta
    if model == "equisolid":
        return 2 * f * np.sin(theta / 2)
    if model == "stereographic":
        return 2 * f * np.tan(theta / 2)
    if model == "kannala_brandt":
        return f * theta * (1 + sum(k * theta ** (2 * i + 2) for i, k in enumerate(lens["k"])))
    raise ValueError(f"lens model {model!r} is unknown; use equidistant, equisolid, stereographic or kannala_brandt")


def theta_of(lens, radius):
    """The inverse of `radius_of`; NaN beyond the lens's largest angle."""
    table = np.linspace(0, lens["max_theta"], 2048)
    return np.interp(radius, radius_of(lens, table), table, right=np.nan)


def make_lens(rng, circle_radius):
    """A random lens whose field of view fills a circle of this radius."""
    model = str(rng.choice(["equidistant", "equidistant", "kannala_brandt", "equisolid", "stereographic"]))
    max_theta = math.radians(float(rng.choice([85, 90, 90, 92, 95]) + rng.uniform(-1.5, 1.5)))
    lens = dict(model=model, focal=1.0, max_theta=max_theta)
    if model == "kannala_brandt":
        lens["k"] = [
            float(x)
            for x in np.array([rng.uniform(-0.03, 0.03), rng.uniform(-0.008, 0.004), rng.uniform(-0.001, 0.002), 0.0])
        ]
    lens["focal"] = float(circle_radius / radius_of(lens, max_theta))
    return lens


def camera_rotation(yaw, tilt=0.0, roll=0.0):
    """World to camera (x right, y down, z along the axis): looks down, tilted up by `tilt` toward the image's up."""
    c, s = math.cos(yaw), math.sin(yaw)
    down = np.array([[c, s, 0], [s, -c, 0], [0, 0, -1.0]])
    ct, st = math.cos(tilt), math.sin(tilt)
    tilted = np.array([[1, 0, 0], [0, ct, st], [0, -st, ct]]) @ down
    cr, sr = math.cos(roll), math.sin(roll)
    return np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]]) @ tilted


def lens_of(native_lens):
    """The lens of a native calibration, as `radius_of` takes it."""
    return dict(native_lens, focal=native_lens.get("focal", native_lens.get("fx")))


def circle_radius(native_lens):
    """The radius in pixels of the circle that a native calibration's lens fills."""
    lens = lens_of(native_lens)
    return float(radius_of(lens, lens["max_theta"]))


def pixels_of(lens, cx, cy, rays):
    """Columns and rows of rays in the camera (… × 3), and their angles from the axis. Rays beyond the lens's largest angle
    land just outside the circle: polynomials fold back there."""
    rho = np.hypot(rays[..., 0], rays[..., 1])
    theta = np.arctan2(rho, rays[..., 2])
    scale = radius_of(lens, np.minimum(theta, lens["max_theta"] + 0.05)) / np.maximum(rho, 1e-12)
    return cx + scale * rays[..., 0], cy + scale * rays[..., 1], theta


@dataclass
class Calibration:
    """A camera of one frame: lens, principal point, rotation and height."""

    width: int
    height: int
    lens: dict
    cx: float
    cy: float
    rotation: np.ndarray = field(default_factory=lambda: camera_rotation(0.0))
    height_m: float = 3.0

    def project(self, points):
        """World points (n × 3, meters) to pixels (n × 2) and angles from the axis, as `pixels_of`."""
        rays = (np.atleast_2d(points) - np.array([0, 0, self.height_m])) @ self.rotation.T
        columns, rows, theta = pixels_of(self.lens, self.cx, self.cy, rays)
        return np.stack([columns, rows], 1), theta

    def rays(self, x, y):
        """World directions of pixels (arrays of one shape); NaN outside the lens circle."""
        dx, dy = x - self.cx, y - self.cy
        r = np.hypot(dx, dy)
        theta = theta_of(self.lens, r)
        scale = np.sin(theta) / np.maximum(r, 1e-12)
        return np.stack([dx * scale, dy * scale, np.cos(theta)], -1) @ self.rotation

    def native(self, identifier):
        """The calibration in Lookdown's native JSON."""
        lens = dict(self.lens)
        if lens["model"] == "kannala_brandt":
            lens["fx"] = lens["fy"] = lens.pop("focal")
        up = self.rotation @ np.array([0, 0, 1.0])
        return dict(
            id=identifier,
            image=dict(width=self.width, height=self.height),
            lens=dict(lens, cx=self.cx, cy=self.cy),
            mount=dict(world_up=[round(float(x), 9) for x in up], height_m=round(self.height_m, 4)),
        )


def nadir_angles(rays):
    """Nadir angle and azimuth of world directions."""
    rho = np.hypot(rays[..., 0], rays[..., 1])
    return np.arctan2(rho, -rays[..., 2]), np.arctan2(rays[..., 0], rays[..., 1])


def panorama_xy(theta, phi, focal):
    """Panorama pixels relative to the nadir."""
    return focal * theta * np.sin(phi), -focal * theta * np.cos(phi)


def panorama_of(points, camera_height, focal):
    """World points as panorama pixels relative to the nadir (n × 2)."""
    theta, phi = nadir_angles(np.asarray(points) - np.array([0, 0, camera_height]))
    return np.stack(panorama_xy(theta, phi, focal), 1)


def panorama_bounds(points, camera_height, focal, margin=3):
    """Whole-pixel bounds (left, top, right, bottom), relative to the nadir, of world points in the panorama."""
    at = panorama_of(points, camera_height, focal)
    (left, top), (right, bottom) = (
        np.floor(at.min(0)).astype(int) - margin,
        np.ceil(at.max(0)).astype(int) + margin + 1,
    )
    return int(left), int(top), int(right), int(bottom)
