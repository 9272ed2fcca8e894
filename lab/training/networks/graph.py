"""An editable ONNX graph from a file."""

from pathlib import Path

import numpy
import onnx
from onnx import NodeProto, helper, numpy_helper


class OnnxGraph:
    """Nodes in their order, and constants by name."""

    def __init__(self, file: Path):
        self._model = onnx.load(file)
        self.nodes = list(self._model.graph.node)
        self.constants = {tensor.name: numpy_helper.to_array(tensor) for tensor in self._model.graph.initializer}

    def producer(self, tensor: str) -> NodeProto | None:
        """The node that produces a tensor; constants and the input of the graph have none."""
        return next((node for node in self.nodes if tensor in node.output), None)

    def users(self, tensor: str) -> list[NodeProto]:
        """The nodes that read a tensor."""
        return [node for node in self.nodes if tensor in node.input]

    def feature_maps(self, node: NodeProto) -> list[str]:
        """The inputs of a node that are neither constants nor left out."""
        return [tensor for tensor in node.input if tensor and tensor not in self.constants]

    def save(self, file: Path, *, note: str = "") -> None:
        """Checks the graph and writes it; the same graph gives the same bytes. `note` is added to its description."""
        graph = self._model.graph
        read = {tensor for node in self.nodes for tensor in node.input}
        del graph.node[:], graph.initializer[:]
        graph.node.extend(self.nodes)
        graph.initializer.extend(_stored(name, value) for name, value in self.constants.items() if name in read)
        self._model.doc_string = " ".join(filter(None, [self._model.doc_string, note]))
        onnx.checker.check_model(self._model, full_check=True)
        file.write_bytes(self._model.SerializeToString(deterministic=True))


def attribute(node: NodeProto, name: str, default):
    """The value of a node's attribute, or `default` where the node does not state it."""
    stated = [helper.get_attribute_value(entry) for entry in node.attribute if entry.name == name]
    return stated[0] if stated else default


def set_attribute(node: NodeProto, name: str, value) -> None:
    """Sets an attribute of a node."""
    kept = [entry for entry in node.attribute if entry.name != name]
    del node.attribute[:]
    node.attribute.extend([*kept, helper.make_attribute(name, value)])


def _stored(name: str, value: numpy.ndarray) -> onnx.TensorProto:
    # A scalar must stay of rank 0, which ascontiguousarray would make 1.
    return numpy_helper.from_array(numpy.ascontiguousarray(value) if value.ndim else value, name)
