"""Collects the nodes and constants of an ONNX graph, and writes it.

The contract of `save_detector`, the same for every model that the set-up converts:

* input `images`: float32 `[N, 3, size, size]`, RGB, 0..255, any N;
* output `boxes`: float32 `[N, A, 4]`, corners x_min, y_min, x_max, y_max in pixels of the input;
* output `scores`: float32 `[N, A]`, how sure the network is of a person, 0..1.
"""

from pathlib import Path

import numpy
import onnx
from onnx import TensorProto, helper, numpy_helper

OPSET_VERSION = 17
IR_VERSION = 8


class OnnxBuilder:
    """An ONNX graph under construction; tensors are identified by name."""

    def __init__(self):
        self.nodes = []
        self.constants = []
        self._count = 0

    def constant(self, value, name: str | None = None) -> str:
        """Adds a constant and returns its name. Plain numbers become float32 scalars."""
        value = numpy.asarray(value, numpy.float32) if isinstance(value, (int, float)) else numpy.asarray(value)
        name = name or self._new_name("constant")
        # A scalar must stay of rank 0, which ascontiguousarray would make 1.
        stored = numpy.ascontiguousarray(value) if value.ndim else value
        self.constants.append(numpy_helper.from_array(stored, name))
        return name

    def node(self, operation: str, inputs: list[str], name: str | None = None, **attributes) -> str:
        """Adds an operation with one output and returns that output's name."""
        name = name or self._new_name(operation)
        self.nodes.append(helper.make_node(operation, inputs, [name], name=name, **attributes))
        return name

    def split(self, tensor: str, sizes: list[int], axis: int) -> list[str]:
        """Cuts a tensor into pieces of these sizes along one axis."""
        name = self._new_name("Split")
        pieces = [f"{name}/{piece}" for piece in range(len(sizes))]
        lengths = self.constant(numpy.array(sizes, numpy.int64))
        self.nodes.append(helper.make_node("Split", [tensor, lengths], pieces, name=name, axis=axis))
        return pieces

    def top(self, tensor: str, count: int) -> tuple[str, str]:
        """The `count` largest values along axis 1, in descending order, and their indices."""
        name = self._new_name("TopK")
        values, indices = f"{name}/values", f"{name}/indices"
        wanted = self.constant(numpy.array([count], numpy.int64))
        self.nodes.append(helper.make_node("TopK", [tensor, wanted], [values, indices], name=name, axis=1))
        return values, indices

    def reshape(self, tensor: str, shape: list[int]) -> str:
        """Reshapes; 0 keeps a dimension, -1 is inferred."""
        return self.node("Reshape", [tensor, self.constant(numpy.array(shape, numpy.int64))])

    def save_detector(self, path: Path, *, boxes: str, scores: str, size: int, anchors: int, description: str) -> None:
        """Names the two outputs of the contract and writes the graph."""
        outputs = {"boxes": (boxes, [anchors, 4]), "scores": (scores, [anchors])}
        self.save(path, outputs=outputs, height=size, width=size, description=description)

    def save(
        self, path: Path, *, outputs: dict[str, tuple[str, list[int]]], height: int, width: int, description: str
    ) -> None:
        """Names the outputs, checks the graph and writes it; the same graph gives the same bytes.

        `outputs` are tensors and their shapes without the first dimension, N, by the names they shall have.
        """
        for name, (tensor, _) in outputs.items():
            self.node("Identity", [tensor], name)
        graph = helper.make_graph(
            self.nodes,
            "person_detector",
            [helper.make_tensor_value_info("images", TensorProto.FLOAT, ["N", 3, height, width])],
            [
                helper.make_tensor_value_info(name, TensorProto.FLOAT, ["N", *shape])
                for name, (_, shape) in outputs.items()
            ],
            self.constants,
        )
        model = helper.make_model(
            graph,
            opset_imports=[helper.make_opsetid("", OPSET_VERSION)],
            producer_name="lookdown",
            ir_version=IR_VERSION,
            doc_string=description,
        )
        onnx.checker.check_model(model, full_check=True)
        path.write_bytes(model.SerializeToString(deterministic=True))

    def _new_name(self, stem: str) -> str:
        self._count += 1
        return f"{stem.lower()}_{self._count}"
