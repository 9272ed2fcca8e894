"""The detector: one model in memory, for any number of frames."""

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from lookdown import _lookdown
from lookdown._files import use_packaged_files
from lookdown._lookdown import Calibration, View
from lookdown.detections import Detections
from lookdown.pixels import ChannelOrder, rgb

Path = str | os.PathLike[str]


class Detector:
    """Detects persons in frames. Frames may be given by several threads at a time."""

    def __init__(self, profile: str = "balanced", *, config: Path | None = None, **parameters: Any) -> None:
        """Loads the models of the profile.

        `parameters` are those of `POST /detect`, such as `score_threshold=0.5`. `config` is a settings file of the
        server.
        """
        use_packaged_files()
        given = {name: _text(value) for name, value in parameters.items() if value is not None}
        self._detector = _lookdown.Detector({"profile": profile, **given}, config)

    def detect(
        self,
        image: Path | bytes | npt.NDArray[Any],
        calibration: Calibration | Path | None = None,
        *,
        channel_order: ChannelOrder = "RGB",
    ) -> Detections:
        """Detects the persons in an image file, its content, or pixels of shape (height, width, 3).

        OpenCV reads images in the channel order "BGR". Without a calibration, an ideal lens of 180° on the circle in the
        frame is assumed.
        """
        if calibration is not None and not isinstance(calibration, Calibration):
            calibration = Calibration.read(calibration)
        if isinstance(image, np.ndarray):
            report = self._detect_pixels(image, calibration, channel_order)
        elif isinstance(image, bytes):
            report = self._detector.detect_file(image, "", calibration)
        else:
            report = self._detector.detect_file(_lookdown.read_image(image), os.fspath(image), calibration)
        if isinstance(image, np.ndarray) and channel_order == "BGR":
            image = image[..., ::-1]
        return Detections.from_json(report, image)

    def views(self, calibration: Calibration | Path) -> list[View]:
        """Returns the views of the profile for frames of the calibration, in the order in which the network receives them."""
        if not isinstance(calibration, Calibration):
            calibration = Calibration.read(calibration)
        return self._detector.views(calibration)

    def _detect_pixels(
        self, pixels: npt.NDArray[Any], calibration: Calibration | None, channel_order: ChannelOrder
    ) -> str:
        return self._detector.detect_pixels(rgb(pixels, channel_order), "", calibration)


def _text(value: Any) -> str:
    """Returns a parameter as a request has it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)
