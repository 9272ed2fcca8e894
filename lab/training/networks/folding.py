"""Folds padding, shifts and the factors of pixels into convolutions, and moves pooling before activations."""

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
            _pool_before_activation(graph, node)
        elif node.op_type == "Conv":
            _take_pads(graph, node, 0)
            _take_shift(graph, node)
    _take_factor(graph)


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


def _pool_before_activation(graph: OnnxGraph, pool: NodeProto) -> None:
    """Swaps a LeakyRelu, which keeps the order of values, and the pool behind it, which leaves fewer values."""
    activation = graph.producer(pool.input[0])
    if activation is None or activation.op_type != "LeakyRelu" or len(graph.users(pool.input[0])) > 1:
        return
    before, between, after = activation.input[0], activation.output[0], pool.output[0]
    pool.input[0], pool.output[0], activation.input[0], activation.output[0] = before, between, between, after
    first, second = graph.nodes.index(activation), graph.nodes.index(pool)
    graph.nodes[first], graph.nodes[second] = pool, activation


def _take_shift(graph: OnnxGraph, convolution: NodeProto) -> None:
    """Gives a convolution the shift of its channels behind it, or zeros, as its bias."""
    weights = graph.constants[convolution.input[1]]
    bias = numpy.zeros(len(weights), numpy.float32)
    users = graph.users(convolution.output[0])
    if len(users) == 1 and users[0].op_type == "Add":
        shifts = [graph.constants[name] for name in users[0].input if name in graph.constants]
        if [shift.shape for shift in shifts] == [(1, len(weights), 1, 1)]:
            bias = shifts[0].reshape(-1)
            convolution.output[0] = users[0].output[0]
            graph.nodes.remove(users[0])
    # Convolutions that share a constant get copies of their own.
    names = [f"{convolution.name}/{kind}" for kind in ("folded_weights", "folded_bias")]
    graph.constants |= dict(zip(names, (weights, bias), strict=True))
    convolution.input[1:] = names


def _take_factor(graph: OnnxGraph) -> None:
    """Folds the factor of the pixels' normalization into the first convolution. The mean stays: it is what is padded with."""
    first = next(node for node in graph.nodes if node.op_type == "Conv")
    factor = graph.producer(first.input[0])
    if factor is None or factor.op_type != "Mul":
        return
    factors = graph.constants[factor.input[1]].reshape(-1, 1, 1)
    graph.constants[first.input[1]] = graph.constants[first.input[1]] * factors
    first.input[0] = factor.input[0]
    graph.nodes.remove(factor)
