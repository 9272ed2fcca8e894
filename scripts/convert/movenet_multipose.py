"""MoveNet MultiPose Lightning, reduced to positions and sizes of persons: `MODEL_JSON ONNX`.

The published graph follows at most six persons and finds their joints. Its heat map of persons' centers and its
maps of box offsets and sizes make a detector of their own, without that limit.
"""

import sys
from pathlib import Path

from .onnx_builder import OnnxBuilder
from .peaks import Peaks
from .tfjs import read_tfjs
from .translate import Translator

SIZE = 384
STRIDE = 4
CANDIDATES = 100
GRAPH = "StatefulPartitionedCall"
IMAGE_NODE = f"{GRAPH}/Cast"
CENTRES_NODE = f"{GRAPH}/Sigmoid"
OFFSETS_NODE = f"{GRAPH}/box_offset_0/conv2d_6/BiasAdd"  # y, x from the cell's corner, in cells
SIZES_NODE = f"{GRAPH}/box_scale_0/conv2d_5/BiasAdd"  # height, width in cells
EXTRACTOR = f"{GRAPH}/center_net_mobile_net_v2fpn_feature_extractor/model_1"
UPSAMPLINGS = ("up_sampling2d", "up_sampling2d_1", "up_sampling2d_2")
DESCRIPTION = (
    "MoveNet MultiPose Lightning, persons' boxes only. images: RGB 0..255, N x 3 x 384 x 384. "
    "boxes: x_min, y_min, x_max, y_max in input pixels, before non-maximum suppression. scores: 0..1."
)


def convert(model_json: Path, onnx_file: Path) -> None:
    """Reads the TensorFlow.js model and writes the ONNX file."""
    builder = OnnxBuilder()
    translator = Translator(
        read_tfjs(model_json),
        builder,
        feeds={IMAGE_NODE: "images"},
        resize_factors={f"{EXTRACTOR}/{name}/resize/ResizeBilinear": 2.0 for name in UPSAMPLINGS},
    )
    peaks = Peaks(builder, translator.feature_map(CENTRES_NODE), SIZE // STRIDE, CANDIDATES)
    maps = [translator.feature_map(OFFSETS_NODE), translator.feature_map(SIZES_NODE)]
    builder.save_detector(
        onnx_file,
        boxes=_boxes(builder, peaks, builder.node("Concat", maps, axis=1)),
        scores=peaks.scores,
        size=SIZE,
        anchors=CANDIDATES,
        description=DESCRIPTION,
    )


def _boxes(builder: OnnxBuilder, peaks: Peaks, maps: str) -> str:
    """Corners in pixels from the position of a peak and the four maps' values there; no size is negative."""
    offset_y, offset_x, height, width = builder.split(peaks.values(maps, 4), [1, 1, 1, 1], axis=2)
    column, row = peaks.positions()
    zero, half = builder.constant(0.0), builder.constant(0.5)

    def half_extent(extent: str) -> str:
        return builder.node("Mul", [builder.node("Max", [extent, zero]), half])

    x, y = builder.node("Add", [column, offset_x]), builder.node("Add", [row, offset_y])
    half_width, half_height = half_extent(width), half_extent(height)
    corners = [
        builder.node("Sub", [x, half_width]),
        builder.node("Sub", [y, half_height]),
        builder.node("Add", [x, half_width]),
        builder.node("Add", [y, half_height]),
    ]
    return builder.node("Mul", [builder.node("Concat", corners, axis=2), builder.constant(float(STRIDE))])


if __name__ == "__main__":
    convert(Path(sys.argv[1]), Path(sys.argv[2]))
