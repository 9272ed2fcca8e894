"""A calibration from frames of the camera."""

import os
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from lookdown import _lookdown
from lookdown._lookdown import Calibration
from lookdown.pixels import ChannelOrder, rgb

LensModel = Literal["equidistant", "equisolid", "stereographic", "orthographic"]
Image = str | os.PathLike[str] | bytes | npt.NDArray[Any]


class Preview(bytes):
    """A JPEG: straightened views with an assumed lens and with the found one, and the edges that follow the room.

    A notebook shows it.
    """

    def _repr_jpeg_(self) -> bytes:
        return bytes(self)


def calibrate(
    images: Image | Sequence[Image],
    *,
    id: str = "camera",
    height_m: float | None = None,
    lens: LensModel | None = None,
    field_of_view_deg: float | None = None,
    ceiling: bool = False,
    channel_order: ChannelOrder = "RGB",
) -> tuple[Calibration, Preview]:
    """Finds lens, center and tilt of a ceiling camera from the straight edges of the room in its frames.

    An image is a file, its content, or pixels of shape (height, width, 3), which are RGB unless `channel_order="BGR"` is
    given; all have one size. Known values are kept. Cameras that look straight down need `lens`. With `ceiling`, a camera
    is on a ceiling even if one wall fills the image. `Calibration.to_json()` is the file to store, with the standard
    deviations in `sources`. Raises `LookdownError` with the reason if the frames do not determine the camera.
    """
    given = [images] if isinstance(images, str | os.PathLike | bytes | np.ndarray) else images
    contents = [_content(image, channel_order) for image in given]
    calibration, preview = _lookdown.calibrate(contents, id, height_m, lens, field_of_view_deg, ceiling)
    return calibration, Preview(preview)


def _content(image: Image, channel_order: ChannelOrder) -> bytes | npt.NDArray[np.uint8]:
    if isinstance(image, np.ndarray):
        return rgb(image, channel_order)
    return image if isinstance(image, bytes) else _lookdown.read_image(image)
