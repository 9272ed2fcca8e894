"""Measures the activations of a model on views of the samples. Needs `onnxruntime` and `pillow`."""

import tempfile
from pathlib import Path

import numpy
import onnx
import onnxruntime
from onnx import TensorProto, helper

from .graph import OnnxGraph
from .quantize import Activations
from .regions import int8_tensors, moved_tensors
from .views import sample_views

# The values beyond these shares are rare and far out; what they need would make the steps of all others coarser.
SHARE_BELOW = 1e-5
SHARE_OF_PEAKS = 1e-4
BINS = 4096
DIGITS = 6


def channel_peaks(graph: OnnxGraph, samples: Path) -> dict[str, numpy.ndarray]:
    """The largest magnitude of each channel behind each LeakyRelu, without the outermost values of each view."""
    peaks = {node.output[0]: 0.0 for node in graph.nodes if node.op_type == "LeakyRelu"}
    for tensor, values in _activations(graph, list(peaks), samples):
        magnitudes = numpy.abs(values[0]).reshape(values.shape[1], -1)
        peaks[tensor] = numpy.maximum(peaks[tensor], numpy.quantile(magnitudes, 1 - SHARE_OF_PEAKS, axis=1))
    return peaks


def measure(graph: OnnxGraph, samples: Path) -> Activations:
    """The range of each quantized tensor without the outermost values; groups of moved tensors share one."""
    tensors = int8_tensors(graph)
    extremes = {tensor: (numpy.inf, -numpy.inf) for tensor in tensors}
    sums = dict.fromkeys(tensors, 0.0)
    views = 0
    for tensor, values in _activations(graph, tensors, samples):
        low, high = extremes[tensor]
        extremes[tensor] = min(low, values.min()), max(high, values.max())
        sums[tensor] = sums[tensor] + values.mean(axis=(0, 2, 3))
        views += tensor == tensors[0]
    counts = {tensor: numpy.zeros(BINS, numpy.int64) for tensor in tensors}
    for tensor, values in _activations(graph, tensors, samples):
        counts[tensor] += numpy.histogram(values, BINS, extremes[tensor])[0]
    ranges = {tensor: _without_outermost(counts[tensor], *extremes[tensor]) for tensor in tensors}
    for group in moved_tensors(graph):
        lows, highs = zip(*(ranges[tensor] for tensor in group), strict=True)
        ranges |= dict.fromkeys(group, (min(lows), max(highs)))
    return Activations(ranges, {tensor: sums[tensor] / views for tensor in tensors})


def _activations(graph: OnnxGraph, tensors: list[str], samples: Path):
    """The values of the tensors in each view of the samples, with the name of the tensor."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "folded.onnx"
        graph.save(file)
        model = onnx.load(file)
    model.graph.output.extend(helper.make_tensor_value_info(tensor, TensorProto.FLOAT, None) for tensor in tensors)
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    for view in sample_views(samples, session.get_inputs()[0].shape[-1]):
        yield from zip(tensors, session.run(tensors, {"images": view}), strict=True)


def _without_outermost(counts: numpy.ndarray, low: float, high: float) -> tuple[float, float]:
    shares = numpy.cumsum(counts) / counts.sum()
    middles = low + (numpy.arange(BINS) + 0.5) * (high - low) / BINS
    ends = numpy.searchsorted(shares, [SHARE_BELOW, 1 - SHARE_BELOW]).clip(0, BINS - 1)
    shortened = [middles[end] if extreme else 0.0 for end, extreme in zip(ends, (low, high), strict=True)]
    return tuple(float(f"{value:.{DIGITS}g}") for value in shortened)
