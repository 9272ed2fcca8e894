"""Measures the activation ranges of a model on views of the samples. Needs `onnxruntime` and `pillow`."""

import tempfile
from pathlib import Path

import numpy
import onnx
import onnxruntime
from onnx import TensorProto, helper

from .folding import fold
from .graph import OnnxGraph
from .quantize import ActivationRanges
from .regions import int8_tensors, moved_tensors
from .views import sample_views

# The values beyond these shares are rare and far out; what they need would make the steps of all others coarser.
SHARE_BELOW = 1e-5
BINS = 4096
DIGITS = 6


def measure(fp32_file: Path, samples: Path) -> ActivationRanges:
    """The range of each quantized tensor without the outermost values; groups of moved tensors share one."""
    graph = OnnxGraph(fp32_file)
    fold(graph)
    tensors = int8_tensors(graph)
    session = _session_that_shows(graph, tensors)
    size = session.get_inputs()[0].shape[-1]

    def activations():
        for view in sample_views(samples, size):
            yield from zip(tensors, session.run(tensors, {"images": view}), strict=True)

    extremes = {tensor: (numpy.inf, -numpy.inf) for tensor in tensors}
    for tensor, values in activations():
        low, high = extremes[tensor]
        extremes[tensor] = min(low, values.min()), max(high, values.max())
    counts = {tensor: numpy.zeros(BINS, numpy.int64) for tensor in tensors}
    for tensor, values in activations():
        counts[tensor] += numpy.histogram(values, BINS, extremes[tensor])[0]
    ranges = {tensor: _without_outermost(counts[tensor], *extremes[tensor]) for tensor in tensors}
    for group in moved_tensors(graph):
        lows, highs = zip(*(ranges[tensor] for tensor in group), strict=True)
        ranges |= dict.fromkeys(group, (min(lows), max(highs)))
    return ActivationRanges(ranges)


def _session_that_shows(graph: OnnxGraph, tensors: list[str]) -> onnxruntime.InferenceSession:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "folded.onnx"
        graph.save(file)
        model = onnx.load(file)
    model.graph.output.extend(helper.make_tensor_value_info(tensor, TensorProto.FLOAT, None) for tensor in tensors)
    return onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])


def _without_outermost(counts: numpy.ndarray, low: float, high: float) -> tuple[float, float]:
    shares = numpy.cumsum(counts) / counts.sum()
    middles = low + (numpy.arange(BINS) + 0.5) * (high - low) / BINS
    ends = numpy.searchsorted(shares, [SHARE_BELOW, 1 - SHARE_BELOW]).clip(0, BINS - 1)
    shortened = [middles[end] if extreme else 0.0 for end, extreme in zip(ends, (low, high), strict=True)]
    return tuple(float(f"{value:.{DIGITS}g}") for value in shortened)
