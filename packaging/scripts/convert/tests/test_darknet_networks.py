"""Whole networks of the published architectures: outputs, manifests, refusals."""

import functools
import tomllib

from .. import ConversionError
from ..darknet.network import read_network
from . import reference
from .made_up_darknet import COCO_ANCHORS, VOC_ANCHORS, yolov2_cfg, yolov2_tiny_cfg, yolov3_tiny_cfg
from .support import WithDarknetFiles

THINNER = 8


class Answers(WithDarknetFiles):
    def test_yolov2_answers_as_the_reference_does(self):
        self.require_same_answers(yolov2_cfg(64, VOC_ANCHORS, 20, THINNER))

    def test_yolov2_tiny_answers_as_the_reference_does(self):
        self.require_same_answers(yolov2_tiny_cfg(96, COCO_ANCHORS, 80, thinner=THINNER))

    def test_yolov3_tiny_equals_the_reference_in_both_scales(self):
        self.require_same_answers(yolov3_tiny_cfg(64, 80, THINNER), decode=reference.yolov3_boxes)

    def test_yolov3_with_another_person_class_reads_that_class(self):
        names = self.folder / "names.txt"
        names.write_text("cat\nperson\ndog\n", encoding="utf-8")
        decode = functools.partial(reference.yolov3_boxes, person=1)
        self.require_same_answers(yolov3_tiny_cfg(64, 3, THINNER), names, decode)


class Sizes(WithDarknetFiles):
    def parameters(self, cfg: str) -> int:
        self.cfg.write_text(cfg, encoding="utf-8")
        return read_network(self.cfg).parameters

    def test_weight_counts_equal_those_of_the_published_files(self):
        self.assertEqual(self.parameters(yolov2_cfg(416, COCO_ANCHORS, 80)), 50_983_561)
        self.assertEqual(self.parameters(yolov2_tiny_cfg(416, VOC_ANCHORS, 20)), 15_867_885)
        self.assertEqual(self.parameters(yolov3_tiny_cfg(416, 80)), 8_858_734)


class Manifests(WithDarknetFiles):
    def manifest(self, cfg: str, class_names: str | None = None) -> dict:
        self.write(cfg)
        names = self.folder / "names.txt"
        names.write_text(class_names or "", encoding="utf-8")
        self.convert(names if class_names else None)
        return tomllib.loads((self.model / "model.toml").read_text(encoding="utf-8"))

    def test_the_manifest_of_yolov2_tells_head_person_and_anchors(self):
        manifest = self.manifest(yolov2_tiny_cfg(32, VOC_ANCHORS, 20, thinner=THINNER))
        anchors = [VOC_ANCHORS[first : first + 2] for first in range(0, 10, 2)]
        self.assertEqual(manifest["output"], {"head": "yolo_v2", "person_class": 14, "anchors": anchors})
        self.assertEqual(manifest["input"], {"scale": [1 / 255] * 3})
        self.assertEqual((manifest["name"], manifest["onnx"]), ("made_up", "model.onnx"))

    def test_the_manifest_of_yolov3_needs_no_head(self):
        manifest = self.manifest(yolov3_tiny_cfg(32, 80, THINNER))
        self.assertNotIn("output", manifest)
        self.assertEqual(manifest["input"], {"scale": [1 / 255] * 3})

    def test_a_list_of_names_says_which_class_the_person_is(self):
        cfg = yolov2_tiny_cfg(32, VOC_ANCHORS, 3, thinner=THINNER)
        self.assertEqual(self.manifest(cfg, "cat\nperson\ndog\n")["output"]["person_class"], 1)

    def test_unknown_class_count_without_names_is_refused(self):
        with self.assertRaisesRegex(ConversionError, "Which of 3 classes is the person.*--class-names FILE"):
            self.manifest(yolov2_tiny_cfg(32, VOC_ANCHORS, 3, thinner=THINNER))

    def test_a_list_of_names_that_does_not_fit_is_refused(self):
        with self.assertRaisesRegex(ConversionError, "names.txt has 2 names; 3 are needed, one of them 'person'"):
            self.manifest(yolov2_tiny_cfg(32, VOC_ANCHORS, 3, thinner=THINNER), "cat\nperson\n")

    def test_a_folder_with_a_model_is_left_alone(self):
        cfg = yolov2_tiny_cfg(32, VOC_ANCHORS, 20, thinner=THINNER)
        self.manifest(cfg)
        with self.assertRaisesRegex(ConversionError, "holds a model already"):
            self.convert()

    def test_the_same_files_give_the_same_bytes(self):
        self.write(yolov3_tiny_cfg(32, 80, THINNER))
        made = []
        for name in ("one", "two"):
            self.model = self.folder / name
            self.convert()
            made.append((self.model / "model.onnx").read_bytes())
        self.assertEqual(*made)


class Weights(WithDarknetFiles):
    CFG = yolov2_tiny_cfg(32, VOC_ANCHORS, 20, thinner=THINNER)

    def refused_after(self, change, message: str):
        self.write(self.CFG)
        content = self.weights.read_bytes()
        self.weights.write_bytes(change(content))
        with self.assertRaisesRegex(ConversionError, message.format(found=len(change(content)), needed=len(content))):
            self.convert()
        self.assertFalse(self.model.exists())

    def test_headers_of_both_versions_are_read(self):
        for version in ((0, 1), (0, 2)):
            self.model = self.folder / f"version {version[1]}"
            self.write(self.CFG, version)
            self.convert()
        first, second = (self.folder / f"version {number}" / "model.onnx" for number in (1, 2))
        self.assertEqual(first.read_bytes(), second.read_bytes())

    def test_a_file_that_was_cut_short_is_refused_with_both_sizes(self):
        self.refused_after(lambda content: content[:-4], "has {found} bytes; .* needs {needed}. It is cut short")

    def test_a_file_that_is_too_long_is_refused_with_both_sizes(self):
        self.refused_after(lambda content: content + b"\0" * 4, "has {found} bytes; .* needs {needed}. It holds more")

    def test_an_empty_file_is_refused(self):
        self.refused_after(lambda content: b"", "has 0 bytes, fewer than the header")

    def test_a_file_of_another_kind_is_refused(self):
        self.refused_after(lambda content: b"PK\3\4" * 10, "is it a darknet .weights file")
