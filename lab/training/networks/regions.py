"""Selects the part of a network that runs in INT8."""

from onnx import NodeProto

from .graph import OnnxGraph

# Operations that ONNX Runtime runs on integers, or fuses into such operations.
INT8_OPERATIONS = {"Conv", "Clip", "LeakyRelu", "Add", "Concat", "Resize", "MaxPool"}
# Those of them that only move values, or choose among them.
MOVING_OPERATIONS = {"Concat", "Resize", "MaxPool"}
# The first convolutions lose more than all others together: few channels of very different ranges, at full
# resolution. These three are 6 to 9 % of the work.
FLOAT_CONVOLUTIONS = 3


def int8_nodes(graph: OnnxGraph) -> list[NodeProto]:
    """The nodes behind the first convolutions whose results lead to a further convolution.

    The last convolutions, whose results are decoded, and the decoding stay in floating point by that.
    """
    leading = _tensors_that_lead_to_convolutions(graph)
    convolutions = [index for index, node in enumerate(graph.nodes) if node.op_type == "Conv"]
    behind = graph.nodes[convolutions[FLOAT_CONVOLUTIONS] :]
    return [node for node in behind if node.op_type in INT8_OPERATIONS and node.output[0] in leading]


def int8_tensors(graph: OnnxGraph) -> list[str]:
    """The tensors that are quantized: inputs and outputs of those nodes, in order.

    A convolution that only a Clip reads is not rounded itself: rounding the Clip's result does both at once.
    """
    nodes = int8_nodes(graph)
    tensors = [tensor for node in nodes for tensor in (*graph.feature_maps(node), *node.output)]
    return [tensor for tensor in dict.fromkeys(tensors) if [user.op_type for user in graph.users(tensor)] != ["Clip"]]


def moved_tensors(graph: OnnxGraph) -> list[set[str]]:
    """Groups of tensors between which values only move; with one range for a group they move as integers, unchanged."""
    groups: list[set[str]] = []
    for node in int8_nodes(graph):
        if node.op_type in MOVING_OPERATIONS:
            group = {*graph.feature_maps(node), *node.output}
            joined = [other for other in groups if other & group]
            groups = [other for other in groups if other not in joined] + [group.union(*joined)]
    return groups


def _tensors_that_lead_to_convolutions(graph: OnnxGraph) -> set[str]:
    leading: set[str] = set()
    for node in reversed(graph.nodes):
        if node.op_type == "Conv" or leading.intersection(node.output):
            leading.update(graph.feature_maps(node))
    return leading
