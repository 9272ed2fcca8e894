"""Darknet's convolutions: the only layers with weights."""

import math

import numpy

from ..onnx_builder import OnnxBuilder
from .cfg import Section
from .layer import Layer, Shape, activate, activation_of, steps

# Added to the variance before its root is taken. Darknet adds this to the root itself, or 1e-5 to the variance on a
# GPU; for trained networks with larger variances, the outputs differ by less than 0.1 %.
VARIANCE_FLOOR = numpy.float32(1e-6)


class Convolution(Layer):
    """A convolution, normalized over the batch or with biases, and its activation."""

    kind = "convolutional"

    def __init__(self, section: Section, index: int, shapes: dict[int, Shape]):
        section.allow_only(
            *("batch_normalize", "filters", "size", "stride", "pad", "padding", "groups", "activation", "stopbackward")
        )
        self.sources = (index - 1,)
        source = shapes[index - 1]
        self.filters = section.whole("filters", least=1)
        self.size = section.whole("size", 1, least=1)
        self.stride = section.whole("stride", 1, least=1)
        self.padding = self.size // 2 if section.whole("pad", 0) else section.whole("padding", 0)
        self.groups = section.whole("groups", 1, least=1)
        self.normalised = bool(section.whole("batch_normalize", 0))
        self.activation = activation_of(section, "logistic")
        if source.channels % self.groups or self.filters % self.groups:
            raise section.refusal(f"cannot part {source.channels} channels or {self.filters} filters in {self.groups}")
        self.shape = Shape(
            self.filters,
            steps(section, source.height + 2 * self.padding, self.size, self.stride),
            steps(section, source.width + 2 * self.padding, self.size, self.stride),
        )
        self.kernel_shape = (self.filters, source.channels // self.groups, self.size, self.size)
        self.parameters = math.prod(self.kernel_shape) + self.filters * (4 if self.normalised else 1)

    def add_to(self, builder: OnnxBuilder, inputs: list[str], weights: numpy.ndarray) -> str:
        kernel, bias = self.kernel_and_bias(weights)
        convolved = builder.node(
            "Conv",
            [*inputs, builder.constant(kernel), builder.constant(bias)],
            kernel_shape=[self.size, self.size],
            strides=[self.stride, self.stride],
            pads=[self.padding] * 4,
            group=self.groups,
        )
        return activate(builder, self.activation, convolved)

    def kernel_and_bias(self, weights: numpy.ndarray) -> tuple[numpy.ndarray, numpy.ndarray]:
        """The kernel `[filters, channels, size, size]` and the bias `[filters]`, normalization multiplied in.

        In the file: biases, then scales, means and variances if it normalizes, then the kernel.
        """
        vectors = 4 if self.normalised else 1
        bias, *statistics = weights[: vectors * self.filters].reshape(vectors, self.filters)
        kernel = weights[vectors * self.filters :].reshape(self.kernel_shape)
        if self.normalised:
            scales, means, variances = statistics
            factors = scales / numpy.sqrt(variances + VARIANCE_FLOOR)
            kernel, bias = kernel * factors[:, None, None, None], bias - means * factors
        return kernel, bias
