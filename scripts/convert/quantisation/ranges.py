"""Activation ranges: the measured minimum and maximum of each tensor of a network, as a checked-in file."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy

from ..errors import ConversionError

LARGEST = 255


@dataclass(frozen=True)
class ActivationRanges:
    """The ranges of the quantized tensors, measured on the FP32 model with this sum."""

    model_sha256: str
    ranges: dict[str, tuple[float, float]]

    @classmethod
    def read(cls, file: Path) -> "ActivationRanges":
        """Reads the file of `write`."""
        document = json.loads(file.read_text(encoding="utf-8"))
        return cls(document["model_sha256"], {name: tuple(ends) for name, ends in document["ranges"].items()})

    def write(self, file: Path) -> None:
        """Writes one tensor a line."""
        ranges = ",\n".join(f"  {json.dumps(name)}: {json.dumps(ends)}" for name, ends in self.ranges.items())
        text = f'{{"model_sha256": "{self.model_sha256}",\n"ranges": {{\n{ranges}\n}}}}\n'
        file.write_text(text, encoding="utf-8")

    def require_model(self, file: Path) -> None:
        """Refuses a model with another sum."""
        if sha256_of(file) != self.model_sha256:
            raise ConversionError(f"the activation ranges were measured on another model than {file}; measure anew")

    def scale_and_zero_point(self, tensor: str) -> tuple[numpy.float32, numpy.uint8]:
        """The quantization of a tensor to 0..255; 0, the value of padding, stays exact."""
        if tensor not in self.ranges:
            raise ConversionError(f"the range of '{tensor}' was not measured; measure the ranges anew")
        low, high = self.ranges[tensor]
        low, high = min(low, 0.0), max(high, 0.0)
        if not 0 < high - low < numpy.inf:
            raise ConversionError(f"'{tensor}' has the range {low} to {high}, which cannot be divided into 255 steps")
        scale = numpy.float32((high - low) / LARGEST)
        return scale, numpy.uint8(round(-low / float(scale)))


def sha256_of(file: Path) -> str:
    """The sum of a file, in hexadecimal."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
