"""A darknet detector as a model folder for Lookdown: YOLOv2 as its raw map, YOLOv3 with decoded boxes.

Redmon and Farhadi, YOLOv3: An Incremental Improvement, 2018.
"""

from pathlib import Path

import numpy

from ..model_folder import person_class, write_model_folder
from ..onnx_builder import OnnxBuilder
from .files import read_weights
from .heads import Region, Yolo
from .network import Network, read_network


def convert_detector(cfg: Path, weights: Path, folder: Path, name: str, class_names: Path | None) -> str:
    """Writes the model folder and returns a line that describes it."""
    network = read_network(cfg)
    shape, classes = network.input_shape, network.heads[0].classes
    person = person_class(classes, class_names)
    builder = OnnxBuilder()
    maps = network.add_to(builder, "images", read_weights(weights, network.parameters))

    outputs = _outputs(builder, network, maps, person)

    def save(file: Path) -> None:
        builder.save(
            file,
            outputs=outputs,
            height=shape.height,
            width=shape.width,
            description=f"{name}, from {cfg.name}. images: RGB 0..1. Outputs: {', '.join(outputs)}.",
        )

    source = f"darknet {cfg.name} and {weights.name}"
    write_model_folder(folder, name=name, source=source, tables=_tables(network, person), save=save)
    return (
        f"{folder / 'model.onnx'}: {network.parameters / 1e6:.1f} million weights, "
        f"{shape.width} x {shape.height} pixels, person is class {person} of {classes}"
    )


def _outputs(builder: OnnxBuilder, network: Network, maps: list[str], person: int) -> dict:
    """The outputs of the graph and their shapes: the raw map of YOLOv2, or the boxes and scores of YOLOv3."""
    head = network.heads[0]
    if isinstance(head, Region):
        return {"raw": (maps[0], [head.shape.channels, head.shape.height, head.shape.width])}
    boxes, scores, candidates = _decoded(builder, network, maps, person)
    return {"boxes": (boxes, [candidates, 4]), "scores": (scores, [candidates])}


def _tables(network: Network, person: int) -> list[str]:
    """The manifest lines of input and output."""
    lines = ["", "[input]", f"scale = {[1 / 255] * 3}"]
    if not isinstance(network.heads[0], Region):
        return lines
    anchors = network.heads[0].anchors
    return [*lines, "", "[output]", 'head = "yolo_v2"', f"person_class = {person}", f"anchors = {anchors}  # in cells"]


def _decoded(builder: OnnxBuilder, network: Network, maps: list[str], person: int) -> tuple[str, str, int]:
    """Adds the decoding of all maps; returns boxes `[N, A, 4]` in pixels, scores `[N, A]`, and A."""
    boxes, scores, candidates = [], [], 0
    for tensor, head in zip(maps, network.heads, strict=True):
        cells = head.shape.width * head.shape.height
        parted = builder.reshape(tensor, [0, len(head.mask), 5 + head.classes, cells])
        centre, extent, objectness, classes = builder.split(parted, [2, 2, 1, head.classes], axis=2)
        boxes.append(_boxes(builder, centre, extent, head, network.input_shape.width / head.shape.width))
        scores.append(_scores(builder, objectness, classes, head.classes, person))
        candidates += len(head.mask) * cells
    return builder.node("Concat", boxes, axis=1), builder.node("Concat", scores, axis=1), candidates


def _boxes(builder: OnnxBuilder, centre: str, extent: str, head: Yolo, stride: float) -> str:
    """Corners in pixels `[N, anchors x cells, 4]` of a map's `[N, anchors, 2, cells]`, section 2.1 of the paper."""
    rows, columns = numpy.divmod(numpy.arange(head.shape.width * head.shape.height), head.shape.width)
    corner = numpy.stack([columns, rows]).astype(numpy.float32).reshape(1, 1, 2, -1) * numpy.float32(stride)
    inside = builder.node("Mul", [builder.node("Sigmoid", [centre]), builder.constant(float(stride))])
    middle = builder.node("Add", [inside, builder.constant(corner)])
    anchors = numpy.array(head.anchors)[head.mask]
    half_anchors = builder.constant((anchors / 2).astype(numpy.float32).reshape(1, -1, 2, 1))
    half = builder.node("Mul", [builder.node("Exp", [extent]), half_anchors])
    corners = [builder.node("Sub", [middle, half]), builder.node("Add", [middle, half])]
    by_cell = builder.node("Transpose", [builder.node("Concat", corners, axis=2)], perm=[0, 1, 3, 2])
    return builder.reshape(by_cell, [0, -1, 4])


def _scores(builder: OnnxBuilder, objectness: str, classes: str, count: int, person: int) -> str:
    """The scores of the person `[N, anchors x cells]`: objectness times the sigmoid of the class."""
    sizes = [person, 1, count - person - 1]
    pieces = builder.split(classes, [size for size in sizes if size], axis=2)
    factors = [builder.node("Sigmoid", [part]) for part in (objectness, pieces[1 if person else 0])]
    return builder.reshape(builder.node("Mul", factors), [0, -1])
