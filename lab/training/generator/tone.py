"""From linear light to display values: a film-like curve, and its use for images."""

import numpy as np


def curve(linear, contrast=1.0):
    """Maps linear light (.18: mid-gray) to 0 … 1 with a soft shoulder and toe."""
    x = np.maximum(linear, 0) ** contrast * 0.18 ** (1 - contrast)
    mapped = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)  # K. Narkowicz's fit of the ACES curve.
    return np.clip(mapped, 0, 1) ** (1 / 2.2)


def display(linear, exposure):
    return np.rint(curve(linear * exposure) * 255).astype(np.uint8)
