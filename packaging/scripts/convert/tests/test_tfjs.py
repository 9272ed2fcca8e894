"""TensorFlow.js models: weights of every kind that is read, and the attributes of nodes."""

import base64
import json
import tempfile
import unittest
from pathlib import Path

import numpy

from .. import ConversionError
from ..tfjs import read_tfjs

HALVES = numpy.array([[0.5, -2], [3, 0.25]], numpy.float16)
FLOATS = numpy.array([1.5, 2.5], numpy.float32)
WHOLES = numpy.array([7, -1], numpy.int32)
WEIGHTS = [
    {"name": "halves", "shape": [2, 2], "dtype": "float32", "quantization": {"dtype": "float16"}},
    {"name": "floats", "shape": [2], "dtype": "float32"},
    {"name": "wholes", "shape": [2], "dtype": "int32"},
]
SHARD = HALVES.tobytes() + FLOATS.tobytes() + WHOLES.tobytes()


class Reading(unittest.TestCase):
    def read(self, weights=WEIGHTS, shard=SHARD, nodes=()):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "shard.bin").write_bytes(shard)
        manifest = [{"paths": ["shard.bin"], "weights": weights}]
        document = {"modelTopology": {"node": list(nodes)}, "weightsManifest": manifest}
        (folder / "model.json").write_text(json.dumps(document), encoding="utf-8")
        return read_tfjs(folder / "model.json")

    def test_halves_become_floats_and_other_numbers_stay(self):
        constants = self.read().constants
        self.assertEqual(constants["halves"].dtype, numpy.float32)
        numpy.testing.assert_array_equal(constants["halves"], HALVES)
        numpy.testing.assert_array_equal(constants["floats"], FLOATS)
        numpy.testing.assert_array_equal(constants["wholes"], WHOLES)

    def test_weights_stored_in_another_way_are_refused(self):
        weights = [{"name": "w", "shape": [2], "dtype": "float32", "quantization": {"dtype": "uint8", "scale": 0.1}}]
        with self.assertRaisesRegex(ConversionError, "only float16, float32 and int32"):
            self.read(weights)

    def test_shards_larger_than_the_manifest_are_refused(self):
        with self.assertRaisesRegex(ConversionError, "describes 24 bytes of weights, the shards hold 28"):
            self.read(shard=SHARD + b"more")

    def test_attributes_become_plain_values(self):
        fused = [base64.b64encode(name).decode() for name in (b"BiasAdd", b"Relu6")]
        attributes = {"fused_ops": {"list": {"s": fused}}, "strides": {"list": {"i": ["1", "2"]}}, "keep": {"b": True}}
        node = self.read(nodes=[{"name": "n", "op": "Conv2D", "input": ["x"], "attr": attributes}]).node("n")
        self.assertEqual(node.attributes, {"fused_ops": ["BiasAdd", "Relu6"], "strides": [1, 2], "keep": True})
