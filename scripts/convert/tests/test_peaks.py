"""Peaks of a heat map: the strongest local maxima, and the values of other maps there."""

import tempfile
import unittest
from pathlib import Path

import numpy
from onnx.reference import ReferenceEvaluator

from ..onnx_builder import OnnxBuilder
from ..peaks import Peaks
from .support import MaxPool

SIZE, COUNT, CHANNELS = 6, 3, 2


class FoundPeaks(unittest.TestCase):
    def peaks_of(self, heat: numpy.ndarray, maps: numpy.ndarray):
        """Scores, values, columns and rows; both maps are channels of one image."""
        builder = OnnxBuilder()
        heat_map, other_maps = builder.split("images", [1, CHANNELS], axis=1)
        peaks = Peaks(builder, heat_map, SIZE, COUNT)
        columns, rows = peaks.positions()
        outputs = {
            "scores": (peaks.scores, [COUNT]),
            "values": (peaks.values(other_maps, CHANNELS), [COUNT, CHANNELS]),
            "columns": (columns, [COUNT, 1]),
            "rows": (rows, [COUNT, 1]),
        }
        file = Path(self.enterContext(tempfile.TemporaryDirectory())) / "peaks.onnx"
        builder.save(file, outputs=outputs, height=SIZE, width=SIZE, description="")
        images = numpy.concatenate([heat[:, None], maps], axis=1).astype(numpy.float32)
        return ReferenceEvaluator(str(file), new_ops=[MaxPool]).run(list(outputs), {"images": images})

    def test_peaks_suppress_neighbours_per_image(self):
        heat = numpy.zeros((2, SIZE, SIZE))
        heat[0, 2, 4], heat[0, 2, 5], heat[0, 5, 0] = 0.9, 0.8, 0.3
        heat[1, 4, 4], heat[1, 0, 5], heat[1, 3, 1] = 0.5, 0.7, 0.6
        maps = numpy.random.default_rng(6).uniform(0, 1, (2, CHANNELS, SIZE, SIZE))
        scores, values, columns, rows = self.peaks_of(heat, maps)
        numpy.testing.assert_allclose(scores, [[0.9, 0.3, 0], [0.7, 0.6, 0.5]], rtol=1e-6)
        self.assertEqual(columns[0, :2, 0].tolist(), [4, 0])
        self.assertEqual(rows[0, :2, 0].tolist(), [2, 5])
        self.assertEqual(columns[1, :, 0].tolist(), [5, 1, 4])
        self.assertEqual(rows[1, :, 0].tolist(), [0, 3, 4])
        numpy.testing.assert_allclose(values[1], [maps[1, :, 0, 5], maps[1, :, 3, 1], maps[1, :, 4, 4]], rtol=1e-6)
