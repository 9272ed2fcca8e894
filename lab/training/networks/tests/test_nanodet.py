"""The decoding of NanoDet's heads: the best cells, their boxes and their scores."""

import tempfile
import unittest
from pathlib import Path

import numpy
from convert.onnx_builder import OnnxBuilder
from onnx.reference import ReferenceEvaluator
from onnx.reference.op_run import OpRun

from ..nanodet import BEST_CELLS, DISTANCE_BINS, HEADS, SIZE, decode

RANDOM_SEED = 5


class GatherElements(OpRun):
    """GatherElements as ONNX states it. The evaluator's own implementation takes at most 64 elements."""

    def _run(self, data, indices, *, axis):
        return (numpy.take_along_axis(data, indices, axis),)


class Decoding(unittest.TestCase):
    def test_the_best_cells_are_decoded_best_first(self):
        random = numpy.random.default_rng(RANDOM_SEED)
        heads = [random.normal(0, 2, (1, 1 + 4 * DISTANCE_BINS, SIZE // s, SIZE // s)).astype("f4") for s in HEADS]
        builder = OnnxBuilder()
        factor = builder.node("ReduceMean", ["images"], axes=[1, 2, 3])
        boxes, scores = decode(builder, [builder.node("Mul", [factor, builder.constant(head)]) for head in heads])
        file = Path(self.enterContext(tempfile.TemporaryDirectory())) / "decoder.onnx"
        builder.save_detector(file, boxes=boxes, scores=scores, size=SIZE, anchors=BEST_CELLS, description="Heads.")
        # The second image's heads have the opposite sign, so that each image has cells of its own.
        images = numpy.ones((2, 3, SIZE, SIZE), numpy.float32) * numpy.array([1, -1], "f4").reshape(2, 1, 1, 1)
        found_boxes, found_scores = ReferenceEvaluator(str(file), new_ops=[GatherElements]).run(
            None, {"images": images}
        )
        for sign, boxes_of_one, scores_of_one in zip((1, -1), found_boxes, found_scores, strict=True):
            expected_boxes, expected_scores = _all_cells([sign * head[0] for head in heads])
            best = numpy.argsort(-expected_scores)[:BEST_CELLS]
            numpy.testing.assert_allclose(scores_of_one, expected_scores[best], rtol=1e-5)
            numpy.testing.assert_allclose(boxes_of_one, expected_boxes[best], rtol=1e-4, atol=1e-2)


def _all_cells(heads):
    """Boxes and scores of every cell, one by one, as Li et al. (2020) define them."""
    boxes, scores = [], []
    for stride, head in zip(HEADS, heads, strict=True):
        for row, column in numpy.ndindex(head.shape[1:]):
            logit, bins = head[0, row, column], head[1:, row, column].reshape(4, DISTANCE_BINS).astype(float)
            chances = numpy.exp(bins) / numpy.exp(bins).sum(axis=1, keepdims=True)
            left, top, right, bottom = stride * (chances @ numpy.arange(DISTANCE_BINS))
            x, y = (column + 0.5) * stride, (row + 0.5) * stride
            boxes.append((x - left, y - top, x + right, y + bottom))
            scores.append(1 / (1 + numpy.exp(-float(logit))))
    return numpy.array(boxes), numpy.array(scores)
