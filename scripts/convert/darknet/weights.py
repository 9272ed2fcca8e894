"""Reads darknet `.weights` files."""

from pathlib import Path

import numpy

from ..errors import ConversionError

VERSION_BYTES = 12  # major, minor and revision, 32 bits each
# Then the number of training images: 32 bits before version 0.2, 64 bits since.
HEADER_BYTES_BEFORE_0_2 = VERSION_BYTES + 4
HEADER_BYTES = VERSION_BYTES + 8
NUMBER_BYTES = 4
# Darknet marks files with transposed kernels by version numbers from here on.
ODD_VERSION = 1000


def read_weights(file: Path, parameters: int) -> numpy.ndarray:
    """All numbers of the file; their number must match."""
    found = file.stat().st_size
    if found < HEADER_BYTES:
        raise ConversionError(f"{file.name} has {found} bytes, fewer than the header of a darknet .weights file.")
    major, minor, _ = (int(part) for part in numpy.fromfile(file, "<i4", 3))
    if not (0 <= major < ODD_VERSION and 0 <= minor < ODD_VERSION):
        raise ConversionError(f"{file.name} says it is of version {major}.{minor}; is it a darknet .weights file?")
    header = HEADER_BYTES if (major, minor) >= (0, 2) else HEADER_BYTES_BEFORE_0_2
    expected = header + NUMBER_BYTES * parameters
    if found != expected:
        raise ConversionError(
            f"{file.name} has {found} bytes; a network of {parameters} weights needs {expected}. "
            f"{'It is cut short' if found < expected else 'It holds more'}, or it belongs to another .cfg file."
        )
    return numpy.fromfile(file, "<f4", parameters, offset=header)
