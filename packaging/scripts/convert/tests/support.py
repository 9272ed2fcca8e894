"""Shared code of the converter tests: a folder with a darknet network, and the outputs of its graph."""

import tempfile
import unittest
from pathlib import Path

import numpy
from onnx.reference import ReferenceEvaluator
from onnx.reference.op_run import OpRun

from ..darknet.detector import convert_detector
from ..darknet.network import read_network
from . import reference
from .made_up_darknet import write_weights

WEIGHTS_SEED, IMAGE_SEED = 1, 2


class MaxPool(OpRun):
    """MaxPool as ONNX states it. The evaluator's own implementation swaps unequal `pads`."""

    def _run(self, images, *, kernel_shape, pads, strides, **_unused):
        top, left, bottom, right = pads
        outside = ((0, 0), (0, 0), (top, bottom), (left, right))
        padded = numpy.pad(images, outside, constant_values=-numpy.inf)
        windows = numpy.lib.stride_tricks.sliding_window_view(padded, kernel_shape, axis=(2, 3))
        return (windows[:, :, :: strides[0], :: strides[1]].max(axis=(4, 5)),)


class WithDarknetFiles(unittest.TestCase):
    """Gives each test `self.folder` and ways to put networks into it."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory(prefix="dark net ")))
        self.cfg = self.folder / "net.cfg"
        self.weights = self.folder / "net.weights"
        self.model = self.folder / "model"

    def write(self, cfg: str, version: tuple[int, int] = (0, 2)) -> None:
        """Writes the network and weights for it."""
        self.cfg.write_text(cfg, encoding="utf-8")
        write_weights(self.weights, read_network(self.cfg), WEIGHTS_SEED, version)

    def convert(self, class_names: Path | None = None) -> str:
        """Converts the written network."""
        return convert_detector(self.cfg, self.weights, self.model, "made_up", class_names)

    def require_same_answers(self, cfg: str, class_names: Path | None = None, decode=lambda cfg, maps: maps) -> None:
        """Writes and converts the network, and compares its outputs for two images with the reference.

        `decode` turns the raw maps of the reference into the outputs of the graph.
        """
        self.model = Path(tempfile.mkdtemp(dir=self.folder))
        self.write(cfg)
        self.convert(class_names)
        _, net = reference.parse(cfg)[0]
        shape = (2, 3, int(net["height"]), int(net["width"]))
        images = numpy.random.default_rng(IMAGE_SEED).uniform(0, 1, shape).astype(numpy.float32)
        numbers = numpy.fromfile(self.weights, "<f4", offset=20)
        found = ReferenceEvaluator(str(self.model / "model.onnx"), new_ops=[MaxPool]).run(None, {"images": images})
        expected = zip(*(decode(cfg, reference.run(cfg, numbers, image)) for image in images), strict=True)
        for answer, answers in zip(found, expected, strict=True):
            self.assertGreater(answer.std(), 0)
            numpy.testing.assert_allclose(answer, numpy.stack(answers), rtol=1e-3, atol=1e-4)
