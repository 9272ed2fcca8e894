"""Light: irradiance on the floor, and display values of linear light by a film-like curve."""

import numpy as np


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
