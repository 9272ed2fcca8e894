"""Weights of our own in the graph of another model."""

import tempfile
import unittest
from pathlib import Path

import numpy

from ..errors import ConversionError
from ..onnx_builder import OnnxBuilder
from ..quantisation.graph import OnnxGraph
from ..replace_weights import replace_weights

OLD = numpy.full((1, 3, 1, 1), 2.0, numpy.float32)


class Replacing(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        builder = OnnxBuilder()
        scaled = builder.node("Mul", ["images", builder.constant(OLD)])
        scores = builder.reshape(scaled, [0, -1])
        self.source = self.folder / "source.onnx"
        outputs = {"scores": (scores, [3 * 4 * 4])}
        builder.save(self.source, outputs=outputs, height=4, width=4, description="Made up.")
        self.name = next(name for name, value in OnnxGraph(self.source).constants.items() if value.shape == OLD.shape)

    def replaced(self, **weights) -> OnnxGraph:
        numpy.savez(self.folder / "weights.npz", **weights)
        replace_weights(self.source, self.folder / "model.onnx", self.folder / "weights.npz")
        return OnnxGraph(self.folder / "model.onnx")

    def test_weights_are_replaced_in_the_type_of_the_source(self):
        weights = self.replaced(**{self.name: numpy.full(OLD.shape, 0.5, numpy.float16)}).constants[self.name]
        self.assertEqual(weights.dtype, numpy.float32)
        self.assertTrue((weights == 0.5).all())

    def test_weights_of_another_model_are_refused(self):
        with self.assertRaisesRegex(ConversionError, "no weights 'other'"):
            self.replaced(other=OLD)
        with self.assertRaisesRegex(ConversionError, r"has the shape \(3,\) and needs \(1, 3, 1, 1\)"):
            self.replaced(**{self.name: numpy.zeros(3, numpy.float16)})
