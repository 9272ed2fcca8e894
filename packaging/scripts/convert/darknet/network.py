"""A whole darknet network: its layers with their shapes, and as an ONNX graph."""

from dataclasses import dataclass
from pathlib import Path

import numpy

from .. import ConversionError
from ..onnx_builder import OnnxBuilder
from .files import read_cfg
from .heads import Head, Region, Yolo
from .layer import Layer, Shape
from .layers import Convolution, MaxPool, Reorg, Route, Shortcut, Upsample

KINDS = {kind.kind: kind for kind in (Convolution, MaxPool, Route, Shortcut, Upsample, Reorg, Region, Yolo)}
COLOURS = 3


@dataclass(frozen=True)
class Network:
    """Layers in order, for images of `input_shape`."""

    input_shape: Shape
    layers: list[Layer]

    @property
    def parameters(self) -> int:
        """The number of weights of the network."""
        return sum(layer.parameters for layer in self.layers)

    @property
    def heads(self) -> list[Head]:
        """The layers that produce boxes."""
        return [layer for layer in self.layers if isinstance(layer, Head)]

    def add_to(self, builder: OnnxBuilder, image: str, weights: numpy.ndarray) -> list[str]:
        """Adds every layer to the graph and returns the raw maps `[N, channels, height, width]` of the heads.

        `image` is RGB, 0 to 1; `weights` are all of the network's, in order.
        """
        tensors = {-1: image}
        first = 0
        for index, layer in enumerate(self.layers):
            own = weights[first : first + layer.parameters]
            tensors[index] = layer.add_to(builder, [tensors[source] for source in layer.sources], own)
            first += layer.parameters
        return [tensors[index] for index, layer in enumerate(self.layers) if isinstance(layer, Head)]


def read_network(cfg: Path) -> Network:
    """The network that a `.cfg` file describes."""
    sections = read_cfg(cfg)
    if not sections or sections[0].kind not in ("net", "network"):
        raise ConversionError(f"{cfg.name} does not begin with [net]; is this a darknet .cfg file?")
    net, *rest = sections
    input_shape = Shape(net.whole("channels", COLOURS), net.whole("height", least=1), net.whole("width", least=1))
    if input_shape.channels != COLOURS:
        raise net.refusal(f"has channels={input_shape.channels}; images have {COLOURS}")
    shapes = {-1: input_shape}
    layers = []
    for index, section in enumerate(rest):
        if section.kind not in KINDS:
            raise section.refusal(f"has no translation; {', '.join(KINDS)} have")
        layers.append(KINDS[section.kind](section, index, shapes))
        shapes[index] = layers[index].shape
    network = Network(input_shape, layers)
    _require_one_kind_of_head(cfg, network.heads)
    return network


def _require_one_kind_of_head(cfg: Path, heads: list[Head]) -> None:
    regions = sum(isinstance(head, Region) for head in heads)
    if regions > 1 or (regions and len(heads) > 1) or not heads:
        raise ConversionError(f"{cfg.name} has {len(heads)} heads; one [region], or one or more [yolo], are needed")
    if any((head.anchors, head.classes) != (heads[0].anchors, heads[0].classes) for head in heads):
        raise ConversionError(f"{cfg.name} has [yolo] heads with different anchors or classes; they need the same")
