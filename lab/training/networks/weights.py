"""INT8 weights with a scale per output channel."""

import numpy

LARGEST = 127
# The largest sum that rounding, which adds up to one half to either of two weights, cannot take beyond the 128 that
# fit: 128 times an activation of 255 is the most that 16 bits hold.
LARGEST_PAIR = 127
# Biases are integers of 32 bits; one bit of room stays for the sum.
LARGEST_BIAS = 2**30
# The scale of channels without weights.
SMALLEST_SCALE = 1e-12


def quantize_weights(
    weights: numpy.ndarray, bias: numpy.ndarray, input_scale: float, input_means: numpy.ndarray
) -> tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray]:
    """Weights `[outputs, inputs, height, width]` as int8, the bias as int32, and the weights' scales.

    The bias has the scale `input_scale` times that of the weights, as the sums that it is added to. What rounding takes
    from the weights is added to it for inputs of `input_means`, their mean in each channel (Nagel et al., Data-Free
    Quantization, 2019).
    """
    outputs = len(weights)
    scales = numpy.maximum.reduce(
        [
            numpy.abs(weights).reshape(outputs, -1).max(axis=1) / LARGEST,
            _largest_pair(weights) / LARGEST_PAIR,
            numpy.abs(bias) / (input_scale * LARGEST_BIAS),
            numpy.full(outputs, SMALLEST_SCALE),
        ]
    ).astype(numpy.float32)
    steps = scales.astype(numpy.float64)
    integers = numpy.rint(weights / steps[:, None, None, None]).clip(-LARGEST, LARGEST)
    lost = (weights - integers * steps[:, None, None, None]).sum(axis=(2, 3)) @ input_means
    bias_integers = numpy.rint((bias + lost) / (steps * input_scale))
    return integers.astype(numpy.int8), bias_integers.astype(numpy.int32), scales


def _largest_pair(weights: numpy.ndarray) -> numpy.ndarray:
    """Per output channel, the largest sum of magnitudes of two neighboring weights of the same sign.

    x86 CPUs without VNNI multiply and add such pairs in 16 bits and cut off what does not fit.
    """
    first, second = weights[:, 0::2], weights[:, 1::2]
    positive = numpy.maximum(first, 0) + numpy.maximum(second, 0)
    negative = numpy.maximum(-first, 0) + numpy.maximum(-second, 0)
    return numpy.maximum(positive, negative).reshape(len(weights), -1).max(axis=1)
