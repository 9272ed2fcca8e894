"""Activation ranges: the measured minimum and maximum of each tensor of a network."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy
from convert.errors import ConversionError

LARGEST = 255


@dataclass(frozen=True)
class ActivationRanges:
    """The ranges of the quantized tensors."""

    ranges: dict[str, tuple[float, float]]

    def scale_and_zero_point(self, tensor: str) -> tuple[numpy.float32, numpy.uint8]:
        """The quantization of a tensor to 0..255; 0, the value of padding, stays exact."""
        if tensor not in self.ranges:
            raise ConversionError(f"the range of '{tensor}' was not measured")
        low, high = self.ranges[tensor]
        low, high = min(low, 0.0), max(high, 0.0)
        if not 0 < high - low < numpy.inf:
            raise ConversionError(f"'{tensor}' has the range {low} to {high}, which cannot be divided into 255 steps")
        scale = numpy.float32((high - low) / LARGEST)
        return scale, numpy.uint8(round(-low / float(scale)))


def sha256_of(file: Path) -> str:
    """The sum of a file, in hexadecimal."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
