"""Makes the INT8 version of a network.

Integers stand between pairs of QuantizeLinear and DequantizeLinear, which ONNX Runtime turns into integer kernels.
docs/models.md has accuracy and times beside those of FP32.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy
from convert import ConversionError
from onnx import NodeProto, helper

from .equalize import equalize
from .folding import fold
from .graph import OnnxGraph
from .regions import int8_nodes, int8_tensors
from .weights import quantize_weights

NOTE = "INT8 but for the first and the last convolutions."
LARGEST = 255


@dataclass(frozen=True)
class Activations:
    """The ranges of the quantized tensors, and the mean of each of their channels."""

    ranges: dict[str, tuple[float, float]]
    means: dict[str, numpy.ndarray]

    def scale_and_zero_point(self, tensor: str) -> tuple[numpy.float32, numpy.uint8]:
        """The quantization of a tensor to 0..255; 0, the value of padding, stays exact."""
        if tensor not in self.ranges:
            raise ConversionError(f"the range of '{tensor}' was not measured")
        low, high = self.ranges[tensor]
        low, high = min(low, 0.0), max(high, 0.0)
        if not 0 < high - low < numpy.inf:
            raise ConversionError(f"'{tensor}' has the range {low} to {high}, which cannot be divided into 255 steps")
        scale = numpy.float32((high - low) / LARGEST)
        return scale, numpy.uint8(round(-low / float(scale)))


def sha256_of(file: Path) -> str:
    """The sum of a file, in hexadecimal."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def quantize(fp32_file: Path, onnx_file: Path, samples: Path) -> None:
    """Reads the model, measures its activations and writes the INT8 model."""
    # Needs packages that the tests of the rest have not.
    from .calibrate import channel_peaks, measure

    graph = OnnxGraph(fp32_file)
    fold(graph)
    equalize(graph, channel_peaks(graph, samples))
    write_int8(graph, onnx_file, measure(graph, samples))


def write_int8(graph: OnnxGraph, onnx_file: Path, activations: Activations) -> None:
    """Quantizes a folded graph and writes the INT8 model."""
    Quantizer(graph, activations).quantize()
    graph.save(onnx_file, note=NOTE)


class Quantizer:
    """Rewrites the nodes of a folded graph."""

    def __init__(self, graph: OnnxGraph, activations: Activations):
        self.graph = graph
        self._activations = activations
        self._int8_nodes = [node.name for node in int8_nodes(graph)]
        self._int8_tensors = set(int8_tensors(graph))
        self._written: list[NodeProto] = []

    def quantize(self) -> None:
        """Adds QuantizeLinear and DequantizeLinear to every quantized tensor, and replaces weights by integers."""
        for node in self.graph.nodes:
            if node.name in self._int8_nodes and node.op_type == "Conv":
                self._use_integer_weights(node)
            node.input[:] = [_dequantised(name) if name in self._int8_tensors else name for name in node.input]
            self._written.append(node)
            for tensor in self._int8_tensors.intersection(node.output):
                self._round(tensor)
        self.graph.nodes = self._written

    def _round(self, tensor: str) -> None:
        scale, zero_point = self._activations.scale_and_zero_point(tensor)
        self._constants(tensor, scale=scale, zero_point=zero_point)
        parameters = [f"{tensor}/scale", f"{tensor}/zero_point"]
        self._add("QuantizeLinear", [tensor, *parameters], f"{tensor}/quantised")
        self._add("DequantizeLinear", [f"{tensor}/quantised", *parameters], _dequantised(tensor))

    def _use_integer_weights(self, convolution: NodeProto) -> None:
        tensor, *parameters = convolution.input
        weights, bias = (self.graph.constants[name] for name in parameters)
        input_scale, _ = self._activations.scale_and_zero_point(tensor)
        means = self._activations.means[tensor]
        weights, bias, scales = quantize_weights(weights, bias, float(input_scale), means)
        self._dequantise(parameters[0], weights, scales)
        self._dequantise(parameters[1], bias, scales * input_scale)
        convolution.input[1:] = [_dequantised(name) for name in parameters]

    def _dequantise(self, name: str, integers: numpy.ndarray, scales: numpy.ndarray) -> None:
        zero_points = numpy.zeros(len(scales), integers.dtype)
        self._constants(name, quantised=integers, scale=scales, zero_point=zero_points)
        inputs = [f"{name}/{kind}" for kind in ("quantised", "scale", "zero_point")]
        self._add("DequantizeLinear", inputs, _dequantised(name), axis=0)

    def _constants(self, name: str, **values) -> None:
        self.graph.constants |= {f"{name}/{kind}": numpy.asarray(value) for kind, value in values.items()}

    def _add(self, operation: str, inputs: list[str], output: str, **attributes) -> None:
        self._written.append(helper.make_node(operation, inputs, [output], name=output, **attributes))


def _dequantised(tensor: str) -> str:
    return f"{tensor}/dequantised"
