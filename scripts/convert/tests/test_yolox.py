"""YOLOX: the graph equals the reference, and other files are refused."""

import tempfile
import tomllib
import unittest
import zipfile
from pathlib import Path

import numpy
from onnx.reference import ReferenceEvaluator

from ..errors import ConversionError
from ..torch_checkpoint import read_checkpoint
from ..yolox import convert_detector
from . import reference_yolox
from .made_up_yolox import YoloxWeights, write_checkpoint
from .support import MaxPool

SIZE = 64


class WithCheckpoint(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory(prefix="yolo x ")))
        self.checkpoint = self.folder / "yolox.pth"
        self.model = self.folder / "model"

    def write(self, *, separable=False, classes=80, wrapped=True) -> dict[str, numpy.ndarray]:
        weights = YoloxWeights(4, 1, classes, separable, seed=3).weights
        write_checkpoint(self.checkpoint, {"model": weights, "start_epoch": 300} if wrapped else weights)
        return weights

    def convert(self, size=SIZE, class_names=None) -> str:
        return convert_detector(self.checkpoint, self.model, size, "made_up", class_names)


class Answers(WithCheckpoint):
    def require_same_answers(self, person: int, class_names=None, **network):
        weights = self.write(**network)
        self.convert(class_names=class_names)
        images = numpy.random.default_rng(4).uniform(0, 255, (2, 3, SIZE, SIZE)).astype(numpy.float32)
        graph = ReferenceEvaluator(str(self.model / "model.onnx"), new_ops=[MaxPool])
        boxes, scores = graph.run(["boxes", "scores"], {"images": images})
        for image, found_boxes, found_scores in zip(images, boxes, scores, strict=True):
            corners, chances = reference_yolox.run(weights, image)
            numpy.testing.assert_allclose(found_boxes, corners, rtol=1e-3, atol=1e-3)
            numpy.testing.assert_allclose(found_scores, chances[:, person], rtol=1e-3, atol=1e-6)

    def test_whole_convolutions(self):
        self.require_same_answers(person=0)

    def test_separable_convolutions_as_the_smallest_network_has_them(self):
        self.require_same_answers(person=0, separable=True, wrapped=False)

    def test_a_network_whose_person_is_not_the_first_class(self):
        names = self.folder / "names.txt"
        names.write_text("cat\ndog\nperson\n", encoding="utf-8")
        self.require_same_answers(person=2, class_names=names, classes=3)


class Folder(WithCheckpoint):
    def test_the_manifest_needs_no_tables_as_the_graph_decodes(self):
        self.write()
        self.convert()
        manifest = tomllib.loads((self.model / "model.toml").read_text(encoding="utf-8"))
        self.assertEqual(manifest.keys(), {"name", "onnx", "licence", "source"})
        self.assertEqual((manifest["name"], manifest["source"]), ("made_up", "YOLOX yolox.pth"))

    def test_a_size_that_the_strides_do_not_divide_is_refused(self):
        self.write()
        with self.assertRaisesRegex(ConversionError, "The size is 100 pixels; YOLOX needs a multiple of 32"):
            self.convert(size=100)


class Checkpoints(WithCheckpoint):
    def refused(self, message: str):
        with self.assertRaisesRegex(ConversionError, message):
            self.convert()
        self.assertFalse(self.model.exists())

    def test_other_networks_are_refused_with_the_weights_they_lack(self):
        write_checkpoint(self.checkpoint, {"model": {"fc.weight": numpy.zeros((2, 2), numpy.float32)}})
        self.refused("has no weights 'head.cls_preds.0.weight'; is it a checkpoint of YOLOX")

    def test_a_checkpoint_that_was_cut_short_is_refused(self):
        self.write()
        self.checkpoint.write_bytes(self.checkpoint.read_bytes()[:-100])
        self.refused("yolox.pth is not a zip archive")

    def test_nothing_that_a_checkpoint_names_is_run(self):
        harm = self.folder / "harm"
        with zipfile.ZipFile(self.checkpoint, "w") as zipped:
            zipped.writestr("archive/data.pkl", f"cos\nsystem\n(S'touch \"{harm}\"'\ntR.")
        read_checkpoint(self.checkpoint)
        self.assertFalse(harm.exists())

    def test_a_tensor_that_reaches_beyond_what_is_stored_is_refused(self):
        write_checkpoint(self.checkpoint, {"head": numpy.zeros(4, numpy.float32)})
        with zipfile.ZipFile(self.checkpoint) as zipped:
            pickled = zipped.read("archive/data.pkl")
        with zipfile.ZipFile(self.checkpoint, "w") as zipped:
            zipped.writestr("archive/data.pkl", pickled)
            zipped.writestr("archive/data/0", bytes(8))
        self.refused("lies outside its storage of 2 numbers")
