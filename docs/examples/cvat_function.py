"""Automatic annotation function for CVAT: persons as rectangles rotated along them, from a Lookdown server."""

import io
import json
from collections.abc import Sequence
from urllib.parse import urlencode
from urllib.request import Request, urlopen

import cvat_sdk.auto_annotation as cvataa
import cvat_sdk.models as models
import PIL.Image

TIMEOUT_SECONDS = 60
PERSON = 0
"""The ID of the label in the function; CVAT matches labels by their names."""


class Function:
    """A detection function of CVAT."""

    def __init__(self, server: str, calibration: str | None, profile: str) -> None:
        self.server = server.rstrip("/")
        self.parameters = {"profile": profile} | ({"calibration": calibration} if calibration else {})

    @property
    def spec(self) -> cvataa.DetectionFunctionSpec:
        """The labels."""
        return cvataa.DetectionFunctionSpec(labels=[cvataa.label_spec("person", PERSON, type="rectangle")])

    def detect(
        self, context: cvataa.DetectionFunctionContext, image: PIL.Image.Image
    ) -> Sequence[models.LabeledShapeRequest]:
        """Returns a rectangle for each person."""
        parameters = dict(self.parameters)
        if context.conf_threshold is not None:
            parameters["score_threshold"] = str(context.conf_threshold)
        encoded = io.BytesIO()
        image.convert("RGB").save(encoded, "JPEG", quality=95)
        request = Request(f"{self.server}/detect?{urlencode(parameters)}", data=encoded.getvalue())
        with urlopen(request, timeout=TIMEOUT_SECONDS) as answer:
            persons = json.load(answer)["persons"]
        return [rectangle(person["oriented_box"]) for person in persons]


def rectangle(box: dict[str, float]) -> models.LabeledShapeRequest:
    """Returns an oriented box as CVAT has it: unrotated corners, and the clockwise rotation about the center."""
    (x, y), (width, height) = (box["cx"], box["cy"]), (box["width"], box["height"])
    corners = [x - width / 2, y - height / 2, x + width / 2, y + height / 2]
    return cvataa.rectangle(PERSON, corners, rotation=box["angle_deg"] % 360)


def create(server: str = "http://localhost:8080", calibration: str | None = None, profile: str = "quality") -> Function:
    """Returns the function with the parameters of the command line, `-p NAME=str:VALUE`."""
    return Function(server, calibration, profile)
