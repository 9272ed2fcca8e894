"""Pixels of images."""

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from lookdown._lookdown import LookdownError

ChannelOrder = Literal["RGB", "BGR"]


def rgb(pixels: npt.NDArray[Any], channel_order: ChannelOrder) -> npt.NDArray[np.uint8]:
    """Returns pixels in the order RGB, checked."""
    if channel_order not in ("RGB", "BGR"):
        raise LookdownError(f'channel_order: {channel_order!r}; give "RGB" or "BGR"')
    if pixels.dtype != np.uint8 or pixels.ndim != 3:
        raise LookdownError(
            f"image: an array of {pixels.dtype} and shape {pixels.shape}; give uint8 of shape (height, width, 3)"
        )
    return pixels if channel_order == "RGB" else pixels[..., ::-1]
