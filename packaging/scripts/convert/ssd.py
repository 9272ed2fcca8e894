"""The head of an SSD detector trained with the TensorFlow Object Detection API: person class, decoded boxes."""

import numpy

from . import ConversionError
from .onnx_builder import OnnxBuilder
from .tfjs import TfGraph
from .translate import Translator

# The network predicts offsets multiplied by these, for the center and for the logarithm of the size.
CENTRE_SCALE = 10.0
SIZE_SCALE = 5.0
ANCHORS_NODE = "Postprocessor/ExpandDims"


def keep_one_class(graph: TfGraph, class_index: int, feature_maps: int) -> None:
    """Drops every other class from the class predictors, which makes them about ninety times smaller.

    A predictor has one channel per anchor shape and class, the classes of an anchor next to each other.
    """
    for level in range(feature_maps):
        shapes = graph.constant(f"BoxPredictor_{level}/BoxEncodingPredictor/biases").size // 4
        for kind in ("weights", "biases"):
            name = f"BoxPredictor_{level}/ClassPredictor/{kind}"
            values = graph.constant(name)
            graph.constants[name] = values.reshape(*values.shape[:-1], shapes, -1)[..., class_index]


def predictions(translator: Translator, feature_maps: int) -> tuple[str, str]:
    """The raw head: encoded boxes `[N, A, 4]` and logits `[N, A]`, anchors ordered by level, row, column, shape."""
    builder = translator.builder

    def joined(predictor: str, shape: list[int]) -> str:
        levels = []
        for level in range(feature_maps):
            channels_first = translator.feature_map(f"BoxPredictor_{level}/{predictor}/BiasAdd")
            levels.append(builder.reshape(builder.node("Transpose", [channels_first], perm=[0, 2, 3, 1]), shape))
        return builder.node("Concat", levels, axis=1)

    return joined("BoxEncodingPredictor", [0, -1, 4]), joined("ClassPredictor", [0, -1])


def anchors(graph: TfGraph, count: int) -> numpy.ndarray:
    """The anchors stored in the graph: `[A, 4]` of center y, center x, height, width as fractions of the image."""
    corners = graph.constant(ANCHORS_NODE)
    if corners.shape != (1, count, 4):
        raise ConversionError(f"'{ANCHORS_NODE}' has shape {corners.shape}, expected (1, {count}, 4)")
    y_min, x_min, y_max, x_max = corners[0].T
    return numpy.stack([(y_min + y_max) / 2, (x_min + x_max) / 2, y_max - y_min, x_max - x_min], axis=1)


def decode_boxes(builder: OnnxBuilder, encoded: str, anchor_boxes: numpy.ndarray, size: int) -> str:
    """Turns encoded boxes into corners in pixels: `[N, A, 4]`.

    With an anchor (a_y, a_x, a_h, a_w) and predictions (t_y, t_x, t_h, t_w): center y = a_y + a_h t_y / 10,
    height = a_h exp(t_h / 5), and so for x and width (Liu et al., SSD, 2016, eq. 2, with the scales above).
    """

    def per_anchor(values: numpy.ndarray) -> str:
        return builder.constant(values.astype(numpy.float32).reshape(1, -1, 1))

    def centre(offset: str, anchor_centre: numpy.ndarray, anchor_extent: numpy.ndarray) -> str:
        shift = builder.node("Mul", [offset, per_anchor(anchor_extent * (size / CENTRE_SCALE))])
        return builder.node("Add", [shift, per_anchor(anchor_centre * size)])

    def half_extent(log_scale: str, anchor_extent: numpy.ndarray) -> str:
        growth = builder.node("Exp", [builder.node("Mul", [log_scale, builder.constant(1 / SIZE_SCALE)])])
        return builder.node("Mul", [growth, per_anchor(anchor_extent * (size / 2))])

    anchor_y, anchor_x, anchor_height, anchor_width = anchor_boxes.T
    offset_y, offset_x, scale_y, scale_x = builder.split(encoded, [1, 1, 1, 1], axis=2)
    y, half_height = centre(offset_y, anchor_y, anchor_height), half_extent(scale_y, anchor_height)
    x, half_width = centre(offset_x, anchor_x, anchor_width), half_extent(scale_x, anchor_width)
    corners = [
        builder.node("Sub", [x, half_width]),
        builder.node("Sub", [y, half_height]),
        builder.node("Add", [x, half_width]),
        builder.node("Add", [y, half_height]),
    ]
    return builder.node("Concat", corners, axis=2)
