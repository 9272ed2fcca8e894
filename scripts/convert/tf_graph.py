"""A TensorFlow inference graph in memory: nodes by name, and the values of its constants."""

from dataclasses import dataclass

import numpy

from .errors import ConversionError


@dataclass
class TfNode:
    """One operation; `inputs` are names of other nodes."""

    operation: str
    inputs: list[str]
    attributes: dict


@dataclass
class TfGraph:
    """Nodes and constant values, both by node name."""

    nodes: dict[str, TfNode]
    constants: dict[str, numpy.ndarray]

    def node(self, name: str) -> TfNode:
        """The node of that name."""
        if name not in self.nodes:
            raise ConversionError(f"the graph has no node '{name}'")
        return self.nodes[name]

    def constant(self, name: str) -> numpy.ndarray:
        """The value of the constant of that name."""
        if name not in self.constants:
            raise ConversionError(f"the graph has no constant '{name}'")
        return self.constants[name]
