"""Reads a TensorFlow.js graph model: a `model.json` and the weight shards it names, which lie beside it.

The inference graph in memory has nodes by name, and the values of its constants.
"""

import base64
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy

from . import ConversionError

ELEMENT_TYPES = {"float32": numpy.float32, "int32": numpy.int32, "float16": numpy.float16}


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


def read_tfjs(model_json: Path) -> TfGraph:
    """The graph stored in `model_json`."""
    document = json.loads(model_json.read_text(encoding="utf-8"))
    nodes = {
        node["name"]: TfNode(
            operation=node["op"],
            inputs=node.get("input") or [],
            attributes={key: _attribute(value) for key, value in (node.get("attr") or {}).items()},
        )
        for node in document["modelTopology"]["node"]
    }
    constants = {}
    for group in document["weightsManifest"]:
        shards = b"".join((model_json.parent / shard).read_bytes() for shard in group["paths"])
        constants.update(_weights(group["weights"], shards))
    return TfGraph(nodes, constants)


def _weights(entries: list[dict], shards: bytes) -> dict[str, numpy.ndarray]:
    """Cuts the joined shards into tensors; the manifest lists them in order, without gaps."""
    tensors = {}
    offset = 0
    for entry in entries:
        stored_as = entry.get("quantization", entry)["dtype"]
        if stored_as not in ELEMENT_TYPES or entry["dtype"] not in ELEMENT_TYPES:
            raise ConversionError(f"weights stored as {entry} are not read, only float16, float32 and int32")
        stored = numpy.frombuffer(shards, ELEMENT_TYPES[stored_as], math.prod(entry["shape"]), offset)
        tensors[entry["name"]] = stored.astype(ELEMENT_TYPES[entry["dtype"]], copy=False).reshape(entry["shape"])
        offset += stored.nbytes
    if offset != len(shards):
        raise ConversionError(f"the manifest describes {offset} bytes of weights, the shards hold {len(shards)}")
    return tensors


def _attribute(value: dict):
    """The plain Python value of a node attribute; unused kinds stay unchanged."""
    match value:
        case {"s": list(codes)}:
            return bytes(codes).decode()
        case {"s": text}:
            return base64.b64decode(text).decode()
        case {"i": number}:
            return int(number)
        case {"f": number}:
            return float(number)
        case {"b": flag}:
            return bool(flag)
        case {"list": {"i": numbers}}:
            return [int(number) for number in numbers]
        case {"list": {"s": texts}}:
            return [base64.b64decode(text).decode() for text in texts]
        case _:
            return value
