"""The layers that darknet turns into boxes: `[region]` of YOLOv2 and `[yolo]` of YOLOv3."""

import numpy

from ..onnx_builder import OnnxBuilder
from .files import Section
from .layer import Layer, Shape


class Head(Layer):
    """A layer that decodes boxes in darknet. It returns the raw numbers; `detector` decodes those of YOLOv3.

    Per anchor the channels are t_x, t_y, t_w, t_h, t_o and one per class.
    """

    anchors: list[list[float]]
    mask: list[int]
    classes: int

    def add_to(self, builder: OnnxBuilder, inputs: list[str], weights: numpy.ndarray) -> str:
        return inputs[0]

    def _take(self, section: Section, index: int, shapes: dict[int, Shape]) -> None:
        self.sources = (index - 1,)
        self.shape = shapes[index - 1]
        numbers = section.numbers("anchors")
        self.anchors = [numbers[first : first + 2] for first in range(0, len(numbers), 2)]
        self.classes = section.whole("classes", least=1)
        count = section.whole("num", len(numbers) // 2)
        if len(numbers) != 2 * count:
            raise section.refusal(f"has num={count} and {len(numbers)} numbers for anchors; {2 * count} are needed")

    def _require_channels(self, section: Section) -> None:
        found, anchors = self.shape.channels, len(self.mask)
        needed = anchors * (5 + self.classes)
        if found != needed:
            raise section.refusal(f"gets {found} channels; {anchors} anchors and {self.classes} classes need {needed}")


class Region(Head):
    """The head of YOLOv2: one grid, a softmax over the classes, anchors in cells."""

    kind = "region"

    def __init__(self, section: Section, index: int, shapes: dict[int, Shape]):
        self._take(section, index, shapes)
        if section.whole("softmax", 0) != 1 or section.whole("coords", 4) != 4 or "tree" in section.options:
            raise section.refusal("is translated with softmax=1, coords=4 and without a tree of classes only")
        self.mask = list(range(len(self.anchors)))
        self._require_channels(section)


class Yolo(Head):
    """A head of YOLOv3: a grid of one scale, classes independent of each other, anchors in pixels of the input."""

    kind = "yolo"

    def __init__(self, section: Section, index: int, shapes: dict[int, Shape]):
        self._take(section, index, shapes)
        if section.number("scale_x_y", 1) != 1 or section.whole("new_coords", 0):
            raise section.refusal("is translated with scale_x_y=1 and new_coords=0 only")
        self.mask = section.wholes("mask") if "mask" in section.options else list(range(len(self.anchors)))
        if not all(0 <= anchor < len(self.anchors) for anchor in self.mask):
            raise section.refusal(f"has mask={section.options['mask']}; there are {len(self.anchors)} anchors, from 0")
        self._require_channels(section)
