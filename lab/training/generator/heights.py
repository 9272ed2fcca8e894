"""Camera heights: one declaration for persons and rooms, so that every room finds crops that fit."""

import math

import numpy as np

HEIGHTS = np.exp(np.linspace(math.log(2.4), math.log(8.0), 8))
"""Meters. A crop also serves heights up to 9 % away: the person is then so much taller or shorter."""
HEIGHT_SHARES = HEIGHTS**-1.2 / np.sum(HEIGHTS**-1.2)
