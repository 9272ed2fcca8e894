"""Darknet networks of the published architectures, thin ones for tests and whole ones for timing, untrained."""

import struct
from pathlib import Path

import numpy

from ..darknet.layers import Convolution
from ..darknet.network import Network

# Width and height in cells, of the anchors that YOLOv2 was trained with on Pascal VOC and COCO.
VOC_ANCHORS = [1.3221, 1.73145, 3.19275, 4.00944, 5.05587, 8.09892, 9.47112, 4.84053, 11.2364, 10.0071]
COCO_ANCHORS = [0.57273, 0.677385, 1.87446, 2.06253, 3.33843, 5.47434, 7.88282, 3.52778, 9.77052, 9.16828]
YOLOV3_TINY_ANCHORS = [10, 14, 23, 27, 37, 58, 81, 82, 135, 169, 344, 319]
MAX_POOL = {"size": 2, "stride": 2}


def section(kind: str, **options) -> str:
    """One section of a `.cfg` file."""
    return "".join([f"[{kind}]\n", *(f"{name}={value}\n" for name, value in options.items()), "\n"])


def convolution(filters: int, size: int, **changes) -> str:
    """A convolution as the published networks use it: normalized, padded, leaky."""
    usual = {"batch_normalize": 1, "filters": filters, "size": size, "stride": 1, "pad": 1, "activation": "leaky"}
    return section("convolutional", **(usual | changes))


def output(filters: int) -> str:
    """The last convolution before a head."""
    return convolution(filters, 1, activation="linear", batch_normalize=0)


def listed(numbers) -> str:
    """Numbers as the value of an option."""
    return ",".join(str(number) for number in numbers)


def region(anchors: list[float], classes: int) -> str:
    """The head of YOLOv2."""
    return section("region", anchors=listed(anchors), classes=classes, coords=4, num=len(anchors) // 2, softmax=1)


def yolov2_cfg(size: int, anchors: list[float], classes: int, thinner: int = 1) -> str:
    """YOLOv2 for images of `size` pixels; `thinner` divides the filters of every layer but the last."""
    # Darknet-19: a max pooling precedes each doubling of the filters; 1 x 1 convolutions halve them in between.
    parts = [section("net", width=size, height=size, channels=3)]
    for filters, repeats in ((32, 0), (64, 0), (128, 1), (256, 1), (512, 2), (1024, 2)):
        if filters > 32:
            parts.append(section("maxpool", **MAX_POOL))
        parts.append(convolution(filters // thinner, 3))
        for _ in range(repeats):
            parts += [convolution(filters // 2 // thinner, 1), convolution(filters // thinner, 3)]
    parts += [convolution(1024 // thinner, 3)] * 2
    # The finer map from before the last pooling is reordered and joined.
    parts += [section("route", layers=-9), convolution(64 // thinner, 1), section("reorg", stride=2)]
    parts += [section("route", layers="-1,-4"), convolution(1024 // thinner, 3)]
    return "".join([*parts, output(len(anchors) // 2 * (5 + classes)), region(anchors, classes)])


def yolov2_tiny_cfg(size: int, anchors: list[float], classes: int, last: int = 1024, thinner: int = 1) -> str:
    """YOLOv2-tiny; the convolution before the output has `last` filters: 1024 for VOC, 512 for COCO."""
    parts = [section("net", width=size, height=size, channels=3)]
    for filters in (16, 32, 64, 128, 256):
        parts += [convolution(filters // thinner, 3), section("maxpool", **MAX_POOL)]
    parts += [convolution(512 // thinner, 3), section("maxpool", size=2, stride=1)]
    parts += [convolution(1024 // thinner, 3), convolution(last // thinner, 3)]
    return "".join([*parts, output(len(anchors) // 2 * (5 + classes)), region(anchors, classes)])


def yolov3_tiny_cfg(size: int, classes: int, thinner: int = 1) -> str:
    """YOLOv3-tiny."""

    def head(*mask: int) -> str:
        anchors = listed(YOLOV3_TINY_ANCHORS)
        return output(3 * (5 + classes)) + section("yolo", mask=listed(mask), anchors=anchors, classes=classes, num=6)

    parts = [section("net", width=size, height=size, channels=3)]
    for filters in (16, 32, 64, 128, 256):
        parts += [convolution(filters // thinner, 3), section("maxpool", **MAX_POOL)]
    parts += [convolution(512 // thinner, 3), section("maxpool", size=2, stride=1), convolution(1024 // thinner, 3)]
    parts += [convolution(256 // thinner, 1), convolution(512 // thinner, 3), head(3, 4, 5)]
    parts += [section("route", layers=-4), convolution(128 // thinner, 1), section("upsample", stride=2)]
    return "".join([*parts, section("route", layers="-1,8"), convolution(256 // thinner, 3), head(1, 2, 3)])


def write_weights(file: Path, network: Network, seed: int, version: tuple[int, int] = (0, 2)) -> None:
    """Random weights that keep the variance of the values from layer to layer (He et al., 2015, eq. 10)."""
    random = numpy.random.default_rng(seed)
    seen = struct.pack("<q" if version >= (0, 2) else "<i", 64)
    with open(file, "wb") as stream:
        stream.write(struct.pack("<3i", *version, 0) + seen)
        for layer in network.layers:
            if not isinstance(layer, Convolution):
                continue
            vectors = [random.normal(0, 0.1, layer.filters)]
            if layer.normalised:
                vectors += [random.uniform(0.8, 1.2, layer.filters), random.normal(0, 0.1, layer.filters)]
                vectors += [random.uniform(0.5, 1.5, layer.filters)]
            spread = (2 * layer.filters / (layer.parameters - len(vectors) * layer.filters)) ** 0.5
            kernel = random.standard_normal(layer.kernel_shape, numpy.float32) * numpy.float32(spread)
            for values in (*vectors, kernel):
                values.astype("<f4").tofile(stream)
