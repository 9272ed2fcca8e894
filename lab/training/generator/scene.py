"""What persons and rooms share: heights of cameras, values of the id masks, and light."""

import math

import numpy as np

HEIGHTS = np.exp(np.linspace(math.log(2.4), math.log(8.0), 8))
"""Meters. A crop also serves heights up to 9 % away: the person is then so much taller or shorter."""
HEIGHT_SHARES = HEIGHTS**-1.2 / np.sum(HEIGHTS**-1.2)
# Values of the id masks beside persons (1 to 200): things that detectors take for persons.
CHAIR_WITH_JACKET, MANNEQUIN, IMAGE_OF_PERSON, COATS, PRAM = 241, 242, 243, 244, 245
DISTRACTORS = {
    CHAIR_WITH_JACKET: "chair_with_jacket",
    MANNEQUIN: "mannequin",
    IMAGE_OF_PERSON: "image_of_person",
    COATS: "coats",
    PRAM: "pram",
}


def floor_irradiance(lights, ambient, x=0.0, y=0.0):
    """W/m² on a level surface at (x, y, 0), which brings persons and rooms to the same exposure. `lights` are (x, y, z, power in W) of lights that face down; `ambient` is the
    radiance of a uniform upper hemisphere."""
    total = np.pi * ambient
    for lx, ly, lz, power in lights:
        r2 = (lx - x) ** 2 + (ly - y) ** 2 + lz**2
        total += power / np.pi * (lz**2 / r2) / r2
    return float(total)


def curve(linear, contrast=1.0):
    """Maps linear light (.18: mid-gray) to 0 … 1 with a soft shoulder and toe."""
    x = np.maximum(linear, 0) ** contrast * 0.18 ** (1 - contrast)
    mapped = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)  # K. Narkowicz's fit of the ACES curve.
    return np.clip(mapped, 0, 1) ** (1 / 2.2)


def display(linear, exposure):
    return np.rint(curve(linear * exposure) * 255).astype(np.uint8)
