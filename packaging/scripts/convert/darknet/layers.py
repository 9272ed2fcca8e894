"""The layers of darknet networks: convolution, pooling, joining, adding, repeating and reordering.

Shapes follow darknet's rules for rounding and padding, which its source states and its papers do not.
"""

import math

import numpy

from ..onnx_builder import OnnxBuilder
from .files import Section
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


class MaxPool(Layer):
    """Max pooling. Odd padding is at the lower right, as in TensorFlow."""

    kind = "maxpool"

    def __init__(self, section: Section, index: int, shapes: dict[int, Shape]):
        section.allow_only("size", "stride", "padding")
        self.sources = (index - 1,)
        source = shapes[index - 1]
        self.stride = section.whole("stride", 1, least=1)
        self.size = section.whole("size", self.stride, least=1)
        padding = section.whole("padding", self.size - 1)
        height = steps(section, source.height + padding, self.size, self.stride)
        width = steps(section, source.width + padding, self.size, self.stride)
        self.shape = Shape(source.channels, height, width)
        before = padding // 2

        def after(places: int, extent: int) -> int:
            return max(0, (places - 1) * self.stride + self.size - before - extent)

        self.pads = [before, before, after(height, source.height), after(width, source.width)]

    def add_to(self, builder: OnnxBuilder, inputs: list[str], weights: numpy.ndarray) -> str:
        size, strides = [self.size, self.size], [self.stride, self.stride]
        return builder.node("MaxPool", inputs, kernel_shape=size, strides=strides, pads=self.pads)


class Route(Layer):
    """The concatenation of earlier layers along the channels."""

    kind = "route"

    def __init__(self, section: Section, index: int, shapes: dict[int, Shape]):
        section.allow_only("layers")
        self.sources = tuple(_earlier(section, number, index) for number in section.wholes("layers"))
        if not self.sources:
            raise section.refusal("names no layers")
        parts = [shapes[source] for source in self.sources]
        if len({(part.height, part.width) for part in parts}) > 1:
            raise section.refusal(f"joins layers of different sizes: {', '.join(map(str, parts))}")
        self.shape = Shape(sum(part.channels for part in parts), parts[0].height, parts[0].width)

    def add_to(self, builder: OnnxBuilder, inputs: list[str], weights: numpy.ndarray) -> str:
        return inputs[0] if len(inputs) == 1 else builder.node("Concat", inputs, axis=1)


class Shortcut(Layer):
    """The sum of the previous layer and an earlier one."""

    kind = "shortcut"

    def __init__(self, section: Section, index: int, shapes: dict[int, Shape]):
        section.allow_only("from", "activation")
        numbers = section.wholes("from")
        if len(numbers) != 1:
            raise section.refusal("is translated with a single layer in 'from' only")
        self.sources = (index - 1, _earlier(section, numbers[0], index))
        self.shape, added = (shapes[source] for source in self.sources)
        self.activation = activation_of(section, "linear")
        if self.shape != added:
            raise section.refusal(f"adds layers of different shapes: {self.shape} and {added}")

    def add_to(self, builder: OnnxBuilder, inputs: list[str], weights: numpy.ndarray) -> str:
        return activate(builder, self.activation, builder.node("Add", inputs))


class Upsample(Layer):
    """Upsampling by repetition of pixels."""

    kind = "upsample"

    def __init__(self, section: Section, index: int, shapes: dict[int, Shape]):
        section.allow_only("stride")
        self.sources = (index - 1,)
        source = shapes[index - 1]
        self.stride = section.whole("stride", 2, least=1)
        self.shape = Shape(source.channels, source.height * self.stride, source.width * self.stride)

    def add_to(self, builder: OnnxBuilder, inputs: list[str], weights: numpy.ndarray) -> str:
        factors = builder.constant(numpy.array([1, 1, self.stride, self.stride], numpy.float32))
        how = {"mode": "nearest", "coordinate_transformation_mode": "asymmetric", "nearest_mode": "floor"}
        return builder.node("Resize", [*inputs, "", factors], **how)


class Reorg(Layer):
    """Space to depth, in darknet's own order.

    Darknet reads the memory of a map of C channels, H x W, as one of C / s^2 channels, s H x s W, and sorts the
    pixels of every s x s block of that into channels of their own. What comes out lies in memory as C channels,
    H x W again, and is taken for C s^2 channels, H / s x W / s. For C = 64, s = 2 this is not a mere space-to-depth.
    """

    kind = "reorg"

    def __init__(self, section: Section, index: int, shapes: dict[int, Shape]):
        section.allow_only("stride")
        self.sources = (index - 1,)
        self.source = shapes[index - 1]
        self.stride = section.whole("stride", 1, least=1)
        if self.source.channels % self.stride**2 or self.source.height % self.stride or self.source.width % self.stride:
            raise section.refusal(f"with stride {self.stride} cannot part {self.source}")
        height, width = self.source.height // self.stride, self.source.width // self.stride
        self.shape = Shape(self.source.channels * self.stride**2, height, width)

    def add_to(self, builder: OnnxBuilder, inputs: list[str], weights: numpy.ndarray) -> str:
        channels, stride = self.source.channels // self.stride**2, self.stride
        blocks = [0, channels, self.source.height, stride, self.source.width, stride]
        parted = builder.reshape(inputs[0], blocks)
        # N, channel, row, row in block, column, column in block -> both positions in the block come first.
        sorted_out = builder.node("Transpose", [parted], perm=[0, 3, 5, 1, 2, 4])
        return builder.reshape(sorted_out, [0, self.shape.channels, self.shape.height, self.shape.width])


def _earlier(section: Section, number: int, index: int) -> int:
    """The index of an earlier layer, which is counted from the start, or backwards from this one if negative."""
    source = number if number >= 0 else index + number
    if not 0 <= source < index:
        raise section.refusal(f"refers to layer {number}; it is layer {index} itself, and the first is 0")
    return source
