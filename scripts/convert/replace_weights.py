"""Replaces weights of a model by our own trained ones: `SOURCE_ONNX ONNX WEIGHTS_NPZ`.

The archive has one array of half precision for each replaced weight, under its name in the ONNX file. The graph stays
that of the source, and the new weights are stored in its own type.
"""

import sys
from pathlib import Path

import numpy

from .errors import ConversionError
from .quantisation.graph import OnnxGraph

NOTE = "Weights trained on rendered fisheye frames."


def replace_weights(source_file: Path, onnx_file: Path, weights_file: Path) -> None:
    """Reads the source and the weights and writes the model."""
    graph = OnnxGraph(source_file)
    with numpy.load(weights_file, allow_pickle=False) as weights:
        for name in weights.files:
            _replace(graph, name, weights[name])
    graph.save(onnx_file, note=NOTE)


def _replace(graph: OnnxGraph, name: str, weights: numpy.ndarray) -> None:
    if name not in graph.constants:
        raise ConversionError(f"the source has no weights '{name}'; the weights were trained from another model")
    old = graph.constants[name]
    if old.shape != weights.shape:
        raise ConversionError(f"'{name}' has the shape {weights.shape} and needs {old.shape}")
    graph.constants[name] = weights.astype(old.dtype)


if __name__ == "__main__":
    replace_weights(*(Path(argument) for argument in sys.argv[1:4]))
