"""SSDLite MobileNetV2 trained on COCO, from its TensorFlow.js form: `MODEL_JSON ONNX`.

Sandler et al., MobileNetV2: Inverted Residuals and Linear Bottlenecks, 2018.
"""

import sys
from pathlib import Path

from . import ssd
from .onnx_builder import OnnxBuilder
from .tfjs import read_tfjs
from .translate import Translator

SIZE = 300
FEATURE_MAPS = 6
ANCHORS = 1917
PERSON_CLASS = 1  # 0 is the background
NORMALISED_IMAGE_NODE = "Preprocessor/sub"
DESCRIPTION = (
    "SSDLite MobileNetV2 (COCO), person class only. images: RGB 0..255, N x 3 x 300 x 300. "
    "boxes: x_min, y_min, x_max, y_max in input pixels, before non-maximum suppression. scores: 0..1."
)


def convert(model_json: Path, onnx_file: Path) -> None:
    """Reads the TensorFlow.js model and writes the ONNX file."""
    graph = read_tfjs(model_json)
    ssd.keep_one_class(graph, PERSON_CLASS, FEATURE_MAPS)
    builder = OnnxBuilder()
    # The network was trained on pixels scaled to -1..1.
    scaled = builder.node("Mul", ["images", builder.constant(2 / 255)])
    normalised = builder.node("Sub", [scaled, builder.constant(1.0)])
    translator = Translator(graph, builder, feeds={NORMALISED_IMAGE_NODE: normalised})
    encoded, logits = ssd.predictions(translator, FEATURE_MAPS)
    builder.save_detector(
        onnx_file,
        boxes=ssd.decode_boxes(builder, encoded, ssd.anchors(graph, ANCHORS), SIZE),
        scores=builder.node("Sigmoid", [logits]),
        size=SIZE,
        anchors=ANCHORS,
        description=DESCRIPTION,
    )


if __name__ == "__main__":
    convert(Path(sys.argv[1]), Path(sys.argv[2]))
