"""Translates the convolutional part of a TensorFlow graph to ONNX.

TensorFlow stores feature maps as N, height, width, channels; ONNX wants N, channels, height, width. Every tensor
made here is of the second kind, so only weights and constants are ever turned round.
"""

import numpy

from . import ConversionError
from .onnx_builder import OnnxBuilder
from .tfjs import TfGraph, TfNode

# The index of a TensorFlow axis (N, height, width, channels) in N, channels, height, width.
AXES_CHANNELS_FIRST = (0, 2, 3, 1)
TO_CHANNELS_LAST = [0, 2, 3, 1]
TO_CHANNELS_FIRST = [0, 3, 1, 2]


class Translator:
    """Adds TensorFlow nodes, and what they depend on, to an ONNX graph; each node once."""

    def __init__(
        self,
        graph: TfGraph,
        builder: OnnxBuilder,
        feeds: dict[str, str],
        *,
        channels_first_feeds: frozenset[str] = frozenset(),
        resize_factors: dict[str, float] | None = None,
    ):
        """`feeds` maps names of TensorFlow nodes to the ONNX tensors that replace them.

        `channels_first_feeds` are those whose TensorFlow node is itself N, channels, height, width, as in graphs
        that were exported from elsewhere. `resize_factors` says by how much each bilinear resize multiplies height
        and width; the TensorFlow graph states the resulting sizes, which would fit a single input size.
        """
        self.graph = graph
        self.builder = builder
        self._tensors = dict(feeds)
        self._channels_first = set(channels_first_feeds)
        self._resize_factors = resize_factors or {}
        self._operations = {
            "Conv2D": self._convolution,
            "DepthwiseConv2dNative": self._depthwise_convolution,
            "FusedBatchNorm": self._batch_normalisation,
            "MaxPool": self._max_pool,
            "Pad": self._pad,
            "PadV2": self._pad,
            "ConcatV2": self._concatenation,
            "ResizeBilinear": self._resize,
            "Transpose": self._transpose,
            "Relu6": self._relu6,
            "LeakyRelu": self._leaky_relu,
            "Mul": self._arithmetic("Mul"),
            "Add": self._arithmetic("Add"),
            "AddN": self._arithmetic("Add"),
            "BiasAdd": self._arithmetic("Add"),
        }

    def feature_map(self, name: str) -> str:
        """The ONNX tensor `[N, channels, height, width]` of a TensorFlow node."""
        if name not in self._tensors:
            node = self.graph.node(name)
            if node.operation not in self._operations:
                raise ConversionError(f"node '{name}' is a {node.operation}, which has no translation yet")
            self._tensors[name] = self._operations[node.operation](name, node)
            if node.operation != "Transpose" and not self._channels_first.isdisjoint(node.inputs):
                self._channels_first.add(name)
        return self._tensors[name]

    def _convolution(self, name: str, node: TfNode) -> str:
        # height, width, inputs, outputs -> outputs, inputs, height, width
        weights = self.graph.constant(node.inputs[1]).transpose(3, 2, 0, 1)
        return self._convolve(name, node, weights, groups=1)

    def _depthwise_convolution(self, name: str, node: TfNode) -> str:
        # height, width, channels, multiplier -> channels * multiplier, 1, height, width
        weights = self.graph.constant(node.inputs[1])
        height, width, channels, multiplier = weights.shape
        turned = weights.transpose(2, 3, 0, 1).reshape(channels * multiplier, 1, height, width)
        return self._convolve(name, node, turned, groups=channels)

    def _convolve(self, name: str, node: TfNode, weights: numpy.ndarray, groups: int) -> str:
        if node.attributes.get("fused_ops"):
            raise ConversionError(
                f"node '{name}' is fused with {node.attributes['fused_ops']}, which has no translation"
            )
        return self.builder.node(
            "Conv",
            [self.feature_map(node.inputs[0]), self.builder.constant(weights, f"{name}/weights")],
            name,
            kernel_shape=list(weights.shape[2:]),
            strides=node.attributes["strides"][1:3],
            dilations=node.attributes.get("dilations", [1, 1, 1, 1])[1:3],
            group=groups,
            **_padding(name, node),
        )

    def _batch_normalisation(self, name: str, node: TfNode) -> str:
        parameters = [
            self.builder.constant(self.graph.constant(parameter), f"{name}/{kind}")
            for parameter, kind in zip(node.inputs[1:], ("scale", "offset", "mean", "variance"), strict=True)
        ]
        inputs = [self.feature_map(node.inputs[0]), *parameters]
        return self.builder.node("BatchNormalization", inputs, name, epsilon=node.attributes["epsilon"])

    def _max_pool(self, name: str, node: TfNode) -> str:
        return self.builder.node(
            "MaxPool",
            [self.feature_map(node.inputs[0])],
            name,
            kernel_shape=node.attributes["ksize"][1:3],
            strides=node.attributes["strides"][1:3],
            **_padding(name, node),
        )

    def _pad(self, name: str, node: TfNode) -> str:
        image = self.feature_map(node.inputs[0])
        pads = numpy.zeros((2, 4), numpy.int64)
        for axis, before_and_after in enumerate(self.graph.constant(node.inputs[1])):
            pads[:, self._axis(node.inputs[0], axis)] = before_and_after
        inputs = [image, self.builder.constant(pads.reshape(-1), f"{name}/pads")]
        if len(node.inputs) == 3:
            inputs.append(self.builder.constant(self.graph.constant(node.inputs[2]), f"{name}/value"))
        return self.builder.node("Pad", inputs, name)

    def _concatenation(self, name: str, node: TfNode) -> str:
        parts = [self.feature_map(part) for part in node.inputs[:-1]]
        axis = int(self.graph.constant(node.inputs[-1]))
        return self.builder.node("Concat", parts, name, axis=self._axis(node.inputs[0], axis))

    def _resize(self, name: str, node: TfNode) -> str:
        if name not in self._resize_factors or node.attributes.get("align_corners"):
            raise ConversionError(f"node '{name}' resizes, and no factor was given for it, or it aligns corners")
        factor = self._resize_factors[name]
        factors = self.builder.constant(numpy.array([1, 1, factor, factor], numpy.float32), f"{name}/factors")
        pixels = "half_pixel" if node.attributes.get("half_pixel_centers") else "asymmetric"
        inputs = [self.feature_map(node.inputs[0]), "", factors]
        return self.builder.node("Resize", inputs, name, mode="linear", coordinate_transformation_mode=pixels)

    def _transpose(self, name: str, node: TfNode) -> str:
        """Only the order of TensorFlow's axes changes; the ONNX tensor is channels-first before and after."""
        image = self.feature_map(node.inputs[0])
        was_channels_first = node.inputs[0] in self._channels_first
        order = self.graph.constant(node.inputs[1]).tolist()
        if order != (TO_CHANNELS_LAST if was_channels_first else TO_CHANNELS_FIRST):
            raise ConversionError(f"node '{name}' transposes by {order}, which is not a move of the channels")
        if not was_channels_first:
            self._channels_first.add(name)
        return image

    def _relu6(self, name: str, node: TfNode) -> str:
        limits = [self.builder.constant(0.0, f"{name}/low"), self.builder.constant(6.0, f"{name}/high")]
        return self.builder.node("Clip", [self.feature_map(node.inputs[0]), *limits], name)

    def _leaky_relu(self, name: str, node: TfNode) -> str:
        image = self.feature_map(node.inputs[0])
        return self.builder.node("LeakyRelu", [image], name, alpha=node.attributes["alpha"])

    def _arithmetic(self, operation: str):
        def translate(name: str, node: TfNode) -> str:
            return self.builder.node(operation, [self._operand(name, operand) for operand in node.inputs], name)

        return translate

    def _operand(self, user: str, name: str) -> str:
        """A feature map, or a constant per channel in a shape that broadcasts against feature maps."""
        if name not in self.graph.constants:
            return self.feature_map(name)
        return self.builder.constant(self.graph.constant(name).reshape(1, -1, 1, 1), f"{user}/per_channel")

    def _axis(self, name: str, axis: int) -> int:
        """The index of an axis of a TensorFlow feature map in the ONNX tensor."""
        return axis if name in self._channels_first else AXES_CHANNELS_FIRST[axis]


def _padding(name: str, node: TfNode) -> dict:
    match node.attributes["padding"]:
        case "SAME":
            # TensorFlow puts the odd pixel of padding at the lower right.
            return {"auto_pad": "SAME_UPPER"}
        case "VALID":
            return {}
        case other:
            raise ConversionError(f"node '{name}' pads {other}, only SAME and VALID are translated")
