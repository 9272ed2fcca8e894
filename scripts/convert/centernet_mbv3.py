"""CenterNet with a MobileNetV3 trunk trained on COCO, from its TensorFlow.js form: `MODEL_JSON ONNX SIZE`.

The network is convolutional throughout, so that one set of weights serves every input size that is a multiple
of 32. Zhou et al., Objects as Points, 2019; Howard et al., Searching for MobileNetV3, 2019.
"""

import sys
from pathlib import Path

import numpy

from .onnx_builder import OnnxBuilder
from .peaks import Peaks
from .tf_graph import TfGraph
from .tfjs import read_tfjs
from .translate import Translator

STRIDE = 4
CANDIDATES = 100
PERSON_CLASS = 0
IMAGE_NODE = "tower_0/images"
CLASS_PREDICTOR = "CenternetHead/centernet_cls_output"
CENTRES_NODE = "tower_0/Sigmoid"
DISTANCES_NODE = "tower_0/mul"  # from the peak to the left, upper, right, lower side, in pixels
RESIZE_FACTORS = {
    "tower_0/CenternetHead/c5_upsample/up_sampling2d/ResizeBilinear": 2.0,
    "tower_0/CenternetHead/c4_upsample/up_sampling2d_1/ResizeBilinear": 2.0,
    "tower_0/CenternetHead/c3_upsample/up_sampling2d_2/ResizeBilinear": 2.0,
}


def convert(model_json: Path, onnx_file: Path, size: int) -> None:
    """Reads the TensorFlow.js model and writes the ONNX file for pictures of `size` x `size` pixels."""
    graph = read_tfjs(model_json)
    _keep_person_class(graph)
    builder = OnnxBuilder()
    # The graph scales the pixels itself.
    translator = Translator(graph, builder, feeds={IMAGE_NODE: "images"}, resize_factors=RESIZE_FACTORS)
    peaks = Peaks(builder, translator.feature_map(CENTRES_NODE), size // STRIDE, CANDIDATES)
    builder.save_detector(
        onnx_file,
        boxes=_boxes(builder, peaks, translator.feature_map(DISTANCES_NODE)),
        scores=peaks.scores,
        size=size,
        anchors=CANDIDATES,
        description=(
            f"CenterNet MobileNetV3 (COCO), person class only. images: RGB 0..255, N x 3 x {size} x {size}. "
            "boxes: x_min, y_min, x_max, y_max in input pixels, before non-maximum suppression. scores: 0..1."
        ),
    )


def _keep_person_class(graph: TfGraph) -> None:
    for kind in ("pointwise_weights", "biases"):
        name = f"{CLASS_PREDICTOR}/{kind}"
        graph.constants[name] = graph.constant(name)[..., PERSON_CLASS : PERSON_CLASS + 1]


def _boxes(builder: OnnxBuilder, peaks: Peaks, distances: str) -> str:
    """Corners in pixels, `[N, candidates, 4]`."""
    stride = builder.constant(float(STRIDE))
    x, y = (builder.node("Mul", [position, stride]) for position in peaks.positions())
    outwards = builder.constant(numpy.array([-1, -1, 1, 1], numpy.float32))
    shifts = builder.node("Mul", [peaks.values(distances, 4), outwards])
    return builder.node("Add", [builder.node("Concat", [x, y, x, y], axis=2), shifts])


if __name__ == "__main__":
    convert(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
