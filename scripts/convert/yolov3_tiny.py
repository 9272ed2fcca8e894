"""YOLOv3-tiny trained on COCO, from its darknet form: `CFG ONNX`; the weights lie beside the `.cfg` file.

Redmon and Farhadi, YOLOv3: An Incremental Improvement, 2018.
"""

import sys
from pathlib import Path

from .darknet.network import read_network
from .darknet.weights import read_weights
from .darknet.yolo_boxes import decoded
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
    for head, mask in zip(network.heads, MASKS, strict=True):
        head.mask = mask
    boxes, scores, candidates = decoded(builder, network, maps, person=0)
    builder.save_detector(
        onnx_file,
        boxes=boxes,
        scores=scores,
        size=network.input_shape.width,
        anchors=candidates,
        description=DESCRIPTION,
    )


if __name__ == "__main__":
    convert(Path(sys.argv[1]), Path(sys.argv[2]))
