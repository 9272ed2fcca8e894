"""Stores the weights of a network in half precision: half the file, and the same arithmetic in FP32."""

from pathlib import Path

import numpy
from convert import ConversionError
from onnx import NodeProto, TensorProto, helper

from .graph import OnnxGraph

# Smaller constants are biases and parameters of the decoder, which together are a hundredth of the file.
LEAST_WEIGHTS = 4096
NOTE = "Weights stored in half precision."
HALF = "/half"
"""The end of the name of a constant in half precision."""


def store_halves(fp32_file: Path, onnx_file: Path) -> None:
    """Reads the model in FP32 and writes it with halves, which a Cast turns into FP32 when the model is loaded."""
    graph = OnnxGraph(fp32_file)
    casts = [_cast(graph, name) for name, value in list(graph.constants.items()) if _is_weights(value)]
    graph.nodes = [*casts, *graph.nodes]
    graph.save(onnx_file, note=NOTE)


def _is_weights(value: numpy.ndarray) -> bool:
    return value.dtype == numpy.float32 and value.size >= LEAST_WEIGHTS


def _cast(graph: OnnxGraph, name: str) -> NodeProto:
    with numpy.errstate(over="ignore"):
        halves = graph.constants.pop(name).astype(numpy.float16)
    if not numpy.isfinite(halves).all():
        raise ConversionError(f"a weight of '{name}' is too large for half precision")
    stored = f"{name}{HALF}"
    graph.constants[stored] = halves
    return helper.make_node("Cast", [stored], [name], name=stored, to=TensorProto.FLOAT)
