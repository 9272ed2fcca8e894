"""The camera's look on a composed frame: light of the night, glare, optics, sensor, tone and JPEG. Numpy and OpenCV only."""

import cv2
import numpy as np

from .geometry import circle_radius
from .scene import curve

KINDS = {"day": 0.58, "dim": 0.14, "infrared": 0.18, "monochrome": 0.10}


def random_look(rng):
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    night = kind in ("dim", "infrared")
    return dict(
        kind=kind,
        exposure=float(np.exp(rng.normal() * 0.35)),
        contrast=float(rng.uniform(0.8, 1.35)),
        vignette=float(rng.uniform(0, 0.6)),
        blur=float(rng.choice([0.3, 0.5, 0.8, 1.2]) * rng.uniform(0.7, 1.2)),
        rim_blur=float(rng.uniform(0, 1.4)),
        fringe=float(rng.uniform(-0.0015, 0.0015)),
        glare=float(rng.choice([0, 0.02, 0.08])),
        veil=float(rng.choice([0, 0, 0.02, 0.06])),
        noise=float(rng.uniform(0.004, 0.014) * (rng.uniform(1.5, 4) if night else 1)),
        balance=[float(x) for x in rng.uniform(0.88, 1.12, 2)],
        saturation=float(rng.uniform(0.55, 1.15)),
        sharpen=float(rng.choice([0, 0.3, 0.8])),
        quality=int(rng.integers(38, 96)),
        detail=float(rng.choice([1, 1, 1, 0.75, 0.55])),
        sun=bool(kind == "day" and rng.random() < 0.3),
    )


def infrared(rng, colour, distance, height):
    """One channel, lit by lamps beside the lens: bright below, dark far away; dyes reflect infrared differently."""
    weights = rng.dirichlet((1.2, 1.0, 1.0)).astype(np.float32)
    grey = (colour @ weights) ** rng.uniform(0.6, 0.9)
    near = np.clip(distance, 0.3, None) / height
    light = 1.0 / (0.35 + near**2) ** rng.uniform(0.5, 1.0) + rng.uniform(0, 0.25)
    return np.repeat((grey * light)[..., None], 3, 2)


def exposure_of(colour, inside):
    """The factor that brings the median of the visible frame to mid-gray."""
    return 0.15 / max(float(np.median(colour[inside].mean(-1))), 1e-4)


def _blur(image, sigma):
    return cv2.GaussianBlur(image, (0, 0), sigma) if sigma > 0.25 else image


def _fringe(image, cx, cy, share):
    """Lateral chromatic aberration: red and blue scaled apart about the center."""
    out = image.copy()
    for channel, scale in ((0, 1 + share), (2, 1 - share)):
        m = np.array([[scale, 0, cx * (1 - scale)], [0, scale, cy * (1 - scale)]], np.float32)
        out[..., channel] = cv2.warpAffine(image[..., channel], m, image.shape[1::-1], flags=cv2.INTER_LINEAR)
    return out


def apply_look(rng, look, composition, calibration):
    """The 8-bit BGR frame."""
    colour, h, w = composition.colour, calibration.height, calibration.width
    y, x = np.mgrid[0:h, 0:w].astype(np.float32)
    rim = np.hypot(x - calibration.cx, y - calibration.cy) / circle_radius(calibration.lens)
    inside = rim <= 1
    if look["kind"] == "infrared":
        colour = infrared(rng, colour, composition.distance, calibration.height_m)
    elif look["kind"] == "monochrome":
        colour = np.repeat(colour.mean(2, keepdims=True), 3, 2)
    light = colour * (
        exposure_of(colour, inside & (composition.distance > 0))
        * look["exposure"]
        * (0.45 if look["kind"] == "dim" else 1)
    )
    if look["glare"]:
        bright = np.clip(light - 0.9, 0, 12)
        small = cv2.resize(bright, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
        spread = cv2.GaussianBlur(small, (0, 0), w / 160) + 0.4 * cv2.GaussianBlur(small, (0, 0), w / 40)
        light = light + look["glare"] * 4 * cv2.resize(spread, (w, h))
    light = light + look["veil"] * float(light[inside].mean())
    light = light * (1 - look["vignette"] * np.clip(rim, 0, 1) ** 2)[..., None]
    if look["kind"] in ("day", "dim"):
        light = _fringe(light, calibration.cx, calibration.cy, look["fringe"])
        light = light * np.array([look["balance"][0], 1, look["balance"][1]], np.float32)
    soft = _blur(light, look["blur"] + look["rim_blur"])
    share = (np.clip(rim, 0, 1) ** 3)[..., None]
    light = _blur(light, look["blur"]) * (1 - share) + soft * share
    noise = rng.normal(size=light.shape).astype(np.float32)
    if look["kind"] in ("infrared", "monochrome"):
        noise[:] = noise[..., :1]
    light = light + noise * look["noise"] * np.sqrt(np.clip(light, 0, 2) + 0.02)
    image = curve(np.maximum(light, 0), look["contrast"])
    grey = image.mean(2, keepdims=True)
    image = grey + (image - grey) * (look["saturation"] if look["kind"] != "infrared" else 0)
    if look["sharpen"]:
        image = image + look["sharpen"] * (image - cv2.GaussianBlur(image, (0, 0), 1.2))
    if look["detail"] < 1:
        small = cv2.resize(image, None, fx=look["detail"], fy=look["detail"], interpolation=cv2.INTER_AREA)
        image = cv2.resize(small, (w, h), interpolation=cv2.INTER_CUBIC)
    image[rim > 1.002] = np.abs(rng.normal(size=(int((rim > 1.002).sum()), 3))) * 0.006
    return np.rint(np.clip(image, 0, 1)[..., ::-1] * 255).astype(np.uint8)
