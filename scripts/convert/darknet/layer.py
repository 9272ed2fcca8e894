"""The interface of all layers of a darknet network: inputs, shape, weights, ONNX nodes."""

from dataclasses import dataclass
from typing import ClassVar

import numpy

from ..onnx_builder import OnnxBuilder
from .cfg import Section


@dataclass(frozen=True)
class Shape:
    """Channels, height and width of a feature map."""

    channels: int
    height: int
    width: int

    def __str__(self):
        return f"{self.channels} x {self.height} x {self.width}"


class Layer:
    """A layer: `sources` are the layers it reads, -1 the image; `parameters` is the number of its weights."""

    kind: ClassVar[str]
    sources: tuple[int, ...]
    shape: Shape
    parameters = 0

    def __init__(self, section: Section, index: int, shapes: dict[int, Shape]):
        """`index` is the layer's own; `shapes` are those of the previous layers, and of the image."""
        raise NotImplementedError

    def add_to(self, builder: OnnxBuilder, inputs: list[str], weights: numpy.ndarray) -> str:
        """Adds the layer's nodes for these ONNX inputs; `weights` are its own, in the order of the file."""
        raise NotImplementedError


def steps(section: Section, extent: int, size: int, stride: int) -> int:
    """The number of window positions along an extent in pixels, padding included."""
    if extent < size:
        raise section.refusal(f"has a window of {size} pixels where {extent} are left; is the input too small?")
    return (extent - size) // stride + 1
