"""Translates the convolutional part of a TensorFlow graph to ONNX.

TensorFlow stores feature maps as N, height, width, channels; ONNX wants N, channels, height, width. Every tensor
made here is of the second kind, so only weights and constants are ever turned round.
"""

import numpy

from .onnx_builder import OnnxBuilder
from .tf_graph import ConversionError, TfGraph, TfNode


class Translator:
    """Adds TensorFlow nodes, and what they depend on, to an ONNX graph; each node once."""

    def __init__(self, graph: TfGraph, builder: OnnxBuilder, feeds: dict[str, str]):
        """`feeds` says where to stop: TensorFlow node name to the ONNX tensor that takes its place."""
        self.graph = graph
        self.builder = builder
        self._tensors = dict(feeds)
        self._operations = {
            "Conv2D": self._convolution,
            "DepthwiseConv2dNative": self._depthwise_convolution,
            "FusedBatchNorm": self._batch_normalisation,
            "Relu6": self._relu6,
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
        if node.attributes["padding"] != "SAME":
            raise ConversionError(f"node '{name}' pads {node.attributes['padding']}, only SAME is translated")
        return self.builder.node(
            "Conv",
            [self.feature_map(node.inputs[0]), self.builder.constant(weights, f"{name}/weights")],
            name,
            kernel_shape=list(weights.shape[2:]),
            strides=node.attributes["strides"][1:3],
            dilations=node.attributes["dilations"][1:3],
            group=groups,
            # TensorFlow puts the odd pixel of padding at the lower right.
            auto_pad="SAME_UPPER",
        )

    def _batch_normalisation(self, name: str, node: TfNode) -> str:
        parameters = [
            self.builder.constant(self.graph.constant(parameter), f"{name}/{kind}")
            for parameter, kind in zip(node.inputs[1:], ("scale", "offset", "mean", "variance"), strict=True)
        ]
        inputs = [self.feature_map(node.inputs[0]), *parameters]
        return self.builder.node("BatchNormalization", inputs, name, epsilon=node.attributes["epsilon"])

    def _relu6(self, name: str, node: TfNode) -> str:
        limits = [self.builder.constant(0.0, f"{name}/low"), self.builder.constant(6.0, f"{name}/high")]
        return self.builder.node("Clip", [self.feature_map(node.inputs[0]), *limits], name)

    def _arithmetic(self, operation: str):
        def translate(name: str, node: TfNode) -> str:
            return self.builder.node(operation, [self._operand(name, operand) for operand in node.inputs], name)

        return translate

    def _operand(self, user: str, name: str) -> str:
        """A feature map, or a constant per channel in a shape that broadcasts against feature maps."""
        if name not in self.graph.constants:
            return self.feature_map(name)
        return self.builder.constant(self.graph.constant(name).reshape(1, -1, 1, 1), f"{user}/per_channel")
