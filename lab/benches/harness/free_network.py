"""Makes networks that cost nothing, so that the cost of everything else is visible."""

from pathlib import Path

import numpy as np
from onnx import TensorProto, helper, numpy_helper

from .places import WORK

SIDE = 416
"""The side of the input, as of NanoDet-g, pixels."""
SCORES = (0.9, 0.6, 0.3, 0.1)
"""The scores of the boxes, repeated: both sides of the score threshold."""


def free_network(boxes: int) -> Path:
    """The ONNX file of a network that reads one value of each view and returns the same boxes for all views."""
    file = WORK / f"free-{boxes}.onnx"
    WORK.mkdir(parents=True, exist_ok=True)
    # The server loads a graph without boxes, too, but this one has the same shape of outputs for both.
    count = max(boxes, 1)
    scores = np.resize(np.array(SCORES, np.float32), count)
    if boxes == 0:
        scores[:] = 0
    tensors = {
        "begin": np.zeros(3, np.int64),
        "end": np.ones(3, np.int64),
        "axes": np.array([1, 2, 3], np.int64),
        "zero": np.zeros((), np.float32),
        "per_view": np.array([-1, 1], np.int64),
        "last": np.array([2], np.int64),
        "all_scores": scores.reshape(1, count),
        "all_boxes": upright_boxes(count).reshape(1, count, 4),
    }
    nodes = [
        helper.make_node("Slice", ["images", "begin", "end", "axes"], ["one"]),
        helper.make_node("Mul", ["one", "zero"], ["nothing"]),
        helper.make_node("Reshape", ["nothing", "per_view"], ["column"]),
        helper.make_node("Add", ["column", "all_scores"], ["scores"]),
        helper.make_node("Unsqueeze", ["column", "last"], ["deep"]),
        helper.make_node("Add", ["deep", "all_boxes"], ["boxes"]),
    ]
    graph = helper.make_graph(
        nodes,
        "free",
        [_value("images", ["views", 3, SIDE, SIDE])],
        [_value("boxes", ["views", count, 4]), _value("scores", ["views", count])],
        [numpy_helper.from_array(value, name) for name, value in tensors.items()],
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    file.write_bytes(made.SerializeToString())
    return file


def upright_boxes(count: int) -> np.ndarray:
    """Boxes of standing persons, in a grid over a view."""
    columns = int(np.ceil(np.sqrt(count)))
    row, column = np.divmod(np.arange(count), columns)
    step = SIDE / columns
    width, height = step / 3, min(step * 0.8, 150.0)
    left, top = column * step + width, row * step + step * 0.1
    return np.stack([left, top, left + width, top + height], axis=1).astype(np.float32)


def _value(name, shape):
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
