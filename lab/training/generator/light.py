"""Irradiance on the floor from area lights and ambient light: brings persons and rooms to the same exposure."""

import numpy as np


def floor_irradiance(lights, ambient, x=0.0, y=0.0):
    """W/m² on a level surface at (x, y, 0). `lights` are (x, y, z, power in W) of lights that face down; `ambient` is the
    radiance of a uniform upper hemisphere."""
    total = np.pi * ambient
    for lx, ly, lz, power in lights:
        r2 = (lx - x) ** 2 + (ly - y) ** 2 + lz**2
        total += power / np.pi * (lz**2 / r2) / r2
    return float(total)
