"""The activations of darknet's layers."""

from ..onnx_builder import OnnxBuilder
from .cfg import Section

LEAKY_SLOPE = 0.1


def activation_of(section: Section, default: str) -> str:
    """The name of the activation of a section."""
    name = section.options.get("activation", default)
    if name not in ("linear", "leaky", "relu", "logistic", "mish"):
        raise section.refusal(f"has activation={name}, which has no translation")
    return name


def activate(builder: OnnxBuilder, activation: str, tensor: str) -> str:
    """Adds the activation of a tensor to the graph."""
    match activation:
        case "leaky":
            return builder.node("LeakyRelu", [tensor], alpha=LEAKY_SLOPE)
        case "relu":
            return builder.node("Relu", [tensor])
        case "logistic":
            return builder.node("Sigmoid", [tensor])
        case "mish":
            # x tanh(ln(1 + e^x)): Misra, Mish: A Self Regularized Non-Monotonic Activation Function, 2019.
            return builder.node("Mul", [tensor, builder.node("Tanh", [builder.node("Softplus", [tensor])])])
        case _:
            return tensor
