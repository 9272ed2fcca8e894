"""What persons and rooms share: heights of cameras, and values of the id masks."""

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
