"""NanoDet-g trained on COCO, from its TensorFlow.js form: `MODEL_JSON ONNX [CLASSES]`.

With three classes, all scores are those of a person: a start for networks that find people who lie and who are low.

NanoDet predicts, per cell, the distances from the cell's center to the four sides of the box, each as a
distribution over whole strides (Li et al., Generalized Focal Loss, 2020).
"""

import sys
from pathlib import Path

import numpy
from convert.onnx_builder import OnnxBuilder
from convert.tfjs import TfGraph, read_tfjs
from convert.translate import Translator

SIZE = 416
CLASSES = 80
PERSON_CLASS = 0
DISTANCE_BINS = 11
# The cells that are decoded, as many as a view has candidates by default (`inference.max_detections_per_view`).
BEST_CELLS = 300
# Stride in pixels -> the convolution that predicts classes and distances there, and the addition of its bias.
HEADS = {
    8: ("PartitionedCall/convolution_29", "PartitionedCall/Add_29"),
    16: ("PartitionedCall/convolution_31", "PartitionedCall/Add_33"),
    32: ("PartitionedCall/convolution_33", "PartitionedCall/Add_37"),
}
FIRST_CONVOLUTION = "PartitionedCall/convolution"
RESIZE_FACTORS = {
    "PartitionedCall/resize/ResizeBilinear": 2.0,
    "PartitionedCall/resize_1/ResizeBilinear": 2.0,
    "PartitionedCall/resize_2/ResizeBilinear": 0.5,
    "PartitionedCall/resize_3/ResizeBilinear": 0.5,
}
# The statistics of NanoDet's training images: red, green, blue. The network expects blue first.
MEAN = (123.675, 116.28, 103.53)
DEVIATION = (58.395, 57.12, 57.375)
DESCRIPTION = (
    "NanoDet-g (COCO), person class only. images: RGB 0..255, N x 3 x 416 x 416. "
    "boxes: x_min, y_min, x_max, y_max in input pixels, before non-maximum suppression. scores: 0..1."
)


def convert(model_json: Path, onnx_file: Path, classes: int) -> None:
    """Reads the TensorFlow.js model and writes the ONNX file."""
    graph = read_tfjs(model_json)
    _keep_person_class(graph, classes)
    _take_red_first(graph)
    builder = OnnxBuilder()
    centred = builder.node("Sub", ["images", _per_channel(builder, MEAN)])
    normalised = builder.node("Mul", [centred, _per_channel(builder, 1 / numpy.array(DEVIATION))])
    translator = Translator(
        graph,
        builder,
        feeds={"input_1": normalised},
        channels_first_feeds=frozenset({"input_1"}),
        resize_factors=RESIZE_FACTORS,
    )
    boxes, scores = decode(builder, [translator.feature_map(output) for _, output in HEADS.values()], classes)
    outputs = {
        "boxes": (boxes, [BEST_CELLS, 4]),
        "scores": (scores, [BEST_CELLS, classes] if classes > 1 else [BEST_CELLS]),
    }
    builder.save(onnx_file, outputs=outputs, height=SIZE, width=SIZE, description=DESCRIPTION)


def _keep_person_class(graph: TfGraph, classes: int) -> None:
    """Drops the other classes from the last convolutions: channels are the classes, then 4 sides x 11 bins."""
    channels = [PERSON_CLASS] * classes + [*range(CLASSES, CLASSES + 4 * DISTANCE_BINS)]
    for convolution, output in HEADS.values():
        for name in (graph.node(convolution).inputs[1], graph.node(output).inputs[1]):
            graph.constants[name] = graph.constant(name)[..., channels]


def _take_red_first(graph: TfGraph) -> None:
    """Reverses the input channels of the first convolution, so that the input is red, green, blue."""
    name = graph.node(FIRST_CONVOLUTION).inputs[1]
    graph.constants[name] = graph.constant(name)[:, :, ::-1, :]


def decode(builder: OnnxBuilder, heads: list[str], classes: int = 1) -> tuple[str, str]:
    """Boxes `[N, BEST_CELLS, 4]` and scores `[N, BEST_CELLS]`, or `[N, BEST_CELLS, classes]`, of the heads `[N, classes + 44, rows, columns]`.

    The best cells come first. Only they are decoded: the distributions of all others would be computed for nothing.
    """
    flat = [builder.reshape(head, [0, classes + 4 * DISTANCE_BINS, -1]) for head in heads]
    logits, bins = builder.split(builder.node("Concat", flat, axis=2), [classes, 4 * DISTANCE_BINS], axis=1)
    highest = logits if classes == 1 else builder.node("ReduceMax", [logits], axes=[1])
    best, cells = builder.top(builder.reshape(highest, [0, -1]), BEST_CELLS)
    if classes > 1:
        in_each_class = builder.node("Expand", [builder.reshape(cells, [0, 1, -1]), _integers(builder, 1, classes, 1)])
        best = builder.node("GatherElements", [logits, in_each_class], axis=2)
        best = builder.node("Transpose", [best], perm=[0, 2, 1])
    in_each_bin = builder.node(
        "Expand", [builder.reshape(cells, [0, 1, -1]), _integers(builder, 1, 4 * DISTANCE_BINS, 1)]
    )
    best_bins = builder.reshape(builder.node("GatherElements", [bins, in_each_bin], axis=2), [0, 4, DISTANCE_BINS, -1])
    chances = builder.node("Softmax", [best_bins], axis=2)
    distances = builder.constant(numpy.arange(DISTANCE_BINS, dtype=numpy.float32).reshape(1, 1, -1, 1))
    means = builder.node("ReduceSum", [builder.node("Mul", [chances, distances]), _integers(builder, 2)], keepdims=0)
    centres, outwards = (numpy.concatenate(parts) for parts in zip(*map(_cells, HEADS), strict=True))
    centres, outwards = (builder.node("Gather", [builder.constant(of_all), cells]) for of_all in (centres, outwards))
    shifts = builder.node("Mul", [builder.node("Transpose", [means], perm=[0, 2, 1]), outwards])
    return builder.node("Add", [shifts, centres]), builder.node("Sigmoid", [best])


def _cells(stride: int) -> tuple[numpy.ndarray, numpy.ndarray]:
    """Of the cells of a stride, row by row: the centers as x, y, x, y, and a step outward at each side, in pixels."""
    along = (numpy.arange(SIZE // stride, dtype=numpy.float32) + 0.5) * stride
    y, x = numpy.meshgrid(along, along, indexing="ij")
    centres = numpy.stack([x, y, x, y], axis=-1).reshape(-1, 4)
    return centres, numpy.full_like(centres, stride) * numpy.array([-1, -1, 1, 1], numpy.float32)


def _integers(builder: OnnxBuilder, *values: int) -> str:
    return builder.constant(numpy.array(values, numpy.int64))


def _per_channel(builder: OnnxBuilder, values) -> str:
    return builder.constant(numpy.array(values, numpy.float32).reshape(1, 3, 1, 1))


if __name__ == "__main__":
    convert(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 1)
