"""The interface of all layers of a darknet network: inputs, shape, weights, ONNX nodes. And their activations."""

from dataclasses import dataclass
from typing import ClassVar

import numpy

from ..onnx_builder import OnnxBuilder
from .files import Section

LEAKY_SLOPE = 0.1


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


def activation_of(section: Section, default: str) -> str:
    """The name of the activation of a section."""
    name = section.options.get("activation", default)
    if name not in ("linear", "leaky", "relu", "logistic", "mish"):
        raise section.refusal(f"has activation={name}, which has no translation")
    return name


def activate(builder: OnnxBuilder, activation: str, tensor: str) -> str:
    """Adds the activation of a tensor to the graph."""
    match activation:
        case "leaky":
            return builder.node("LeakyRelu", [tensor], alpha=LEAKY_SLOPE)
        case "relu":
            return builder.node("Relu", [tensor])
        case "logistic":
            return builder.node("Sigmoid", [tensor])
        case "mish":
            # x tanh(ln(1 + e^x)): Misra, Mish: A Self Regularized Non-Monotonic Activation Function, 2019.
            return builder.node("Mul", [tensor, builder.node("Tanh", [builder.node("Softplus", [tensor])])])
        case _:
            return tensor
