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
    weights: numpy.ndarray, bias: numpy.ndarray, input_scale: float
) -> tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray]:
    """Weights `[outputs, inputs, height, width]` as int8, the bias as int32, and the weights' scales.

    The bias has the scale `input_scale` times that of the weights, as the sums that it is added to.
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
    integers = numpy.rint(weights / scales.astype(numpy.float64)[:, None, None, None])
    bias_integers = numpy.rint(bias / (scales.astype(numpy.float64) * input_scale))
    return integers.clip(-LARGEST, LARGEST).astype(numpy.int8), bias_integers.astype(numpy.int32), scales


def _largest_pair(weights: numpy.ndarray) -> numpy.ndarray:
    """Per output channel, the largest sum of magnitudes of two neighboring weights of the same sign.

    x86 CPUs without VNNI multiply and add such pairs in 16 bits and cut off what does not fit. Depthwise convolutions
    have no neighboring inputs.
    """
    outputs, inputs = weights.shape[:2]
    if inputs == 1:
        return numpy.zeros(outputs)
    even = numpy.concatenate([weights, numpy.zeros_like(weights[:, : inputs % 2])], axis=1)
    first, second = even[:, 0::2], even[:, 1::2]
    positive = numpy.maximum(first, 0) + numpy.maximum(second, 0)
    negative = numpy.maximum(-first, 0) + numpy.maximum(-second, 0)
    return numpy.maximum(positive, negative).reshape(outputs, -1).max(axis=1)
