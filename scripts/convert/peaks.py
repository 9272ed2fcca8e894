"""The head of detectors that mark a person by a peak in a heat map (Zhou et al., Objects as Points, 2019)."""

import numpy
from onnx import TensorProto

from .onnx_builder import OnnxBuilder


class Peaks:
    """The strongest local maxima of a heat map `[N, 1, height, width]`."""

    def __init__(self, builder: OnnxBuilder, heat_map: str, width: int, count: int):
        """`width` is the heat map's; `count` peaks are returned, padded with scores of 0."""
        self._builder = builder
        self._width = width
        neighbourhood = builder.node("MaxPool", [heat_map], kernel_shape=[3, 3], strides=[1, 1], pads=[1, 1, 1, 1])
        is_peak = builder.node("Cast", [builder.node("Equal", [heat_map, neighbourhood])], to=TensorProto.FLOAT)
        peaks = builder.reshape(builder.node("Mul", [heat_map, is_peak]), [0, -1])
        self.scores, self._cells = builder.top(peaks, count)

    def values(self, maps: str, channels: int) -> str:
        """The values of maps `[N, channels, height, width]` at the peaks: `[N, count, channels]`."""
        builder = self._builder
        per_cell = builder.node("Transpose", [builder.reshape(maps, [0, channels, -1])], perm=[0, 2, 1])
        every_channel = builder.constant(numpy.array([1, 1, channels], numpy.int64))
        cells = builder.node("Expand", [self._as_column(self._cells), every_channel])
        return builder.node("GatherElements", [per_cell, cells], axis=1)

    def positions(self) -> tuple[str, str]:
        """Column and row of the peaks, each `[N, count, 1]`."""
        width = self._builder.constant(numpy.array(self._width, numpy.int64))
        column, row = (self._builder.node(operation, [self._cells, width]) for operation in ("Mod", "Div"))
        return self._as_float_column(column), self._as_float_column(row)

    def _as_column(self, tensor: str) -> str:
        return self._builder.node("Unsqueeze", [tensor, self._builder.constant(numpy.array([2], numpy.int64))])

    def _as_float_column(self, tensor: str) -> str:
        return self._builder.node("Cast", [self._as_column(tensor)], to=TensorProto.FLOAT)
