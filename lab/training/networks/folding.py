"""Folds scaling, shifting and padding into convolutions, so that fewer tensors need quantization."""

import numpy
from onnx import NodeProto

from .graph import OnnxGraph, attribute, set_attribute

# What an image is padded with where only the largest neighbor counts.
LOWEST = numpy.finfo(numpy.float32).min


def fold(graph: OnnxGraph) -> None:
    """Folds nodes without a change of the function; every convolution has a bias afterwards."""
    for node in list(graph.nodes):
        if node.op_type == "MaxPool":
            _take_pads(graph, node, LOWEST)
        elif node.op_type == "Conv":
            _take_pads(graph, node, 0)
            _state_bias(graph, node)
            while _take_follower(graph, node):
                pass
    for name, value in graph.constants.items():
        if value.dtype == numpy.float64:
            graph.constants[name] = value.astype(numpy.float32)


def _state_bias(graph: OnnxGraph, convolution: NodeProto) -> None:
    weights = graph.constants[convolution.input[1]]
    bias = graph.constants[convolution.input[2]] if len(convolution.input) > 2 else numpy.zeros(len(weights))
    _set_parameters(graph, convolution, weights.astype(numpy.float64), bias.astype(numpy.float64))


def _set_parameters(graph: OnnxGraph, convolution: NodeProto, weights: numpy.ndarray, bias: numpy.ndarray) -> None:
    """Gives convolutions that share a constant copies of their own."""
    names = [f"{convolution.name}/{kind}" for kind in ("folded_weights", "folded_bias")]
    graph.constants |= dict(zip(names, (weights, bias), strict=True))
    convolution.input[:] = [convolution.input[0], *names]


def _take_pads(graph: OnnxGraph, node: NodeProto, value: float) -> None:
    """Folds a padding of rows and columns with `value` into the next node, which pads with the same value."""
    pad = graph.producer(node.input[0])
    if pad is None or pad.op_type != "Pad" or len(graph.users(node.input[0])) > 1:
        return
    if attribute(node, "auto_pad", b"NOTSET") != b"NOTSET":
        return
    padded_with = graph.constants[pad.input[2]] if len(pad.input) > 2 else 0
    top_left, bottom_right = numpy.split(graph.constants[pad.input[1]], 2)
    if (value == 0) != (padded_with == 0) or padded_with > value or top_left[:2].any() or bottom_right[:2].any():
        return
    pads = numpy.concatenate([top_left[2:], bottom_right[2:]]) + attribute(node, "pads", [0] * 4)
    set_attribute(node, "pads", pads.tolist())
    node.input[0] = pad.input[0]
    graph.nodes.remove(pad)


def _take_follower(graph: OnnxGraph, convolution: NodeProto) -> bool:
    """Folds the only node that reads the result, if it scales and shifts channels; returns True if it did."""
    users = graph.users(convolution.output[0])
    if len(users) != 1:
        return False
    follower, absorbed = users[0], users[0]
    if follower.op_type == "Add" and len(graph.feature_maps(follower)) == 2:
        # result + other + shift, a residual block: the shift may as well come before the sum.
        users = graph.users(follower.output[0])
        if len(users) != 1 or users[0].op_type != "Add":
            return False
        absorbed = users[0]
    scale_and_shift = _scale_and_shift(graph, absorbed, len(graph.constants[convolution.input[1]]))
    if scale_and_shift is None:
        return False
    scale, shift = scale_and_shift
    weights, bias = (graph.constants[name] for name in convolution.input[1:])
    _set_parameters(graph, convolution, weights * scale[:, None, None, None], bias * scale + shift)
    last = convolution if absorbed is follower else follower
    last.output[0] = absorbed.output[0]
    graph.nodes.remove(absorbed)
    return True


def _scale_and_shift(graph: OnnxGraph, node: NodeProto, channels: int) -> tuple[numpy.ndarray, numpy.ndarray] | None:
    """The factor and the offset per channel of a node, if it does nothing else."""
    constants = [graph.constants[name].astype(numpy.float64) for name in node.input if name in graph.constants]
    if node.op_type == "BatchNormalization":
        factor, offset, mean, variance = constants
        scale = factor / numpy.sqrt(variance + attribute(node, "epsilon", 1e-5))
        return scale, offset - mean * scale
    if node.op_type not in ("Add", "Mul") or len(constants) != 1 or constants[0].shape != (1, channels, 1, 1):
        return None
    values = constants[0].reshape(channels)
    return (numpy.ones(channels), values) if node.op_type == "Add" else (values, numpy.zeros(channels))
