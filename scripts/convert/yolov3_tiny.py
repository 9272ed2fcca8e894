"""YOLOv3-tiny trained on COCO, from its darknet form: `CFG ONNX`; the weights lie beside the `.cfg` file.

Redmon and Farhadi, YOLOv3: An Incremental Improvement, 2018.
"""

import sys
from pathlib import Path

import numpy

from .darknet.network import read_network
from .darknet.weights import read_weights
from .onnx_builder import OnnxBuilder

# The published file has 0, 1, 2 for the finer map, which fits no box; the weights were trained with these.
MASKS = ([3, 4, 5], [1, 2, 3])
DESCRIPTION = (
    "YOLOv3-tiny (COCO), person class only. images: RGB 0..255, N x 3 x 416 x 416. "
    "boxes: x_min, y_min, x_max, y_max in input pixels, before non-maximum suppression. scores: 0..1."
)


def convert(cfg: Path, onnx_file: Path) -> None:
    """Reads the darknet files and writes the ONNX file."""
    network = read_network(cfg)
    builder = OnnxBuilder()
    scaled = builder.node("Mul", ["images", builder.constant(1 / 255)])
    maps = network.add_to(builder, scaled, read_weights(cfg.with_suffix(".weights"), network.parameters))
    size = network.picture.width
    boxes, scores, candidates = [], [], 0
    for tensor, head, mask in zip(maps, network.heads, MASKS, strict=True):
        cells, anchors = head.shape.width, numpy.array(head.anchors)[mask]
        parted = builder.reshape(tensor, [0, len(mask), 5 + head.classes, cells * cells])
        centre, extent, objectness, classes = builder.split(parted, [2, 2, 1, head.classes], axis=2)
        boxes.append(_boxes(builder, centre, extent, anchors, cells, size / cells))
        scores.append(_scores(builder, objectness, classes, head.classes))
        candidates += len(mask) * cells * cells
    builder.save_detector(
        onnx_file,
        boxes=builder.node("Concat", boxes, axis=1),
        scores=builder.node("Concat", scores, axis=1),
        size=size,
        anchors=candidates,
        description=DESCRIPTION,
    )


def _boxes(builder: OnnxBuilder, centre: str, extent: str, anchors: numpy.ndarray, cells: int, stride: float) -> str:
    """Corners in pixels `[N, anchors x cells, 4]` of a map's `[N, anchors, 2, cells]`, section 2.1 of the paper."""
    rows, columns = numpy.divmod(numpy.arange(cells * cells), cells)
    corner = numpy.stack([columns, rows]).astype(numpy.float32).reshape(1, 1, 2, -1) * numpy.float32(stride)
    inside = builder.node("Mul", [builder.node("Sigmoid", [centre]), builder.constant(float(stride))])
    middle = builder.node("Add", [inside, builder.constant(corner)])
    half_anchors = builder.constant((anchors / 2).astype(numpy.float32).reshape(1, -1, 2, 1))
    half = builder.node("Mul", [builder.node("Exp", [extent]), half_anchors])
    corners = [builder.node("Sub", [middle, half]), builder.node("Add", [middle, half])]
    by_cell = builder.node("Transpose", [builder.node("Concat", corners, axis=2)], perm=[0, 1, 3, 2])
    return builder.reshape(by_cell, [0, -1, 4])


def _scores(builder: OnnxBuilder, objectness: str, classes: str, count: int) -> str:
    """The chance that a box is a person `[N, anchors x cells]`: that there is something, times that it is one.

    Of the classes the person is the first.
    """
    person, _ = builder.split(classes, [1, count - 1], axis=2)
    factors = [builder.node("Sigmoid", [part]) for part in (objectness, person)]
    return builder.reshape(builder.node("Mul", factors), [0, -1])


if __name__ == "__main__":
    convert(Path(sys.argv[1]), Path(sys.argv[2]))
