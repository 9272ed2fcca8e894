"""Reads the files of darknet: a `.cfg` file into its sections, and the numbers of a `.weights` file."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy

from .. import ConversionError

VERSION_BYTES = 12  # major, minor and revision, 32 bits each
# Then the number of training images: 32 bits before version 0.2, 64 bits since.
HEADER_BYTES_BEFORE_0_2 = VERSION_BYTES + 4
HEADER_BYTES = VERSION_BYTES + 8
NUMBER_BYTES = 4
# Darknet marks files with transposed kernels by version numbers from here on.
ODD_VERSION = 1000


@dataclass(frozen=True)
class Section:
    """One `[kind]` and the options below it."""

    kind: str
    place: str
    options: dict[str, str] = field(default_factory=dict)

    def refusal(self, reason: str) -> ConversionError:
        """An error that names the section."""
        return ConversionError(f"{self.place}: [{self.kind}] {reason}")

    def allow_only(self, *names: str) -> None:
        """Refuses options that change the result of the layer and have no translation."""
        for name in self.options:
            if name not in names:
                raise self.refusal(f"has the option '{name}', which has no translation")

    def whole(self, name: str, default: int | None = None, least: int = 0) -> int:
        """A whole number that is at least `least`; without a default it is required."""
        value = self.options.get(name, default)
        if value is None:
            raise self.refusal(f"lacks the option '{name}'")
        number = self._whole(name, value)
        if number < least:
            raise self.refusal(f"has {name}={number}; it has to be at least {least}")
        return number

    def wholes(self, name: str) -> list[int]:
        """Whole numbers between commas."""
        return [self._whole(name, part) for part in self._parts(name)]

    def numbers(self, name: str) -> list[float]:
        """Numbers between commas."""
        try:
            numbers = [float(part) for part in self._parts(name)]
        except ValueError:
            numbers = [math.nan]
        if not numbers or not all(map(math.isfinite, numbers)):
            raise self.refusal(f"has {name}={self.options[name]}; there has to be a number, or several between commas")
        return numbers

    def number(self, name: str, default: float) -> float:
        """A single number."""
        return self.numbers(name)[0] if name in self.options else default

    def _parts(self, name: str) -> list[str]:
        if name not in self.options:
            raise self.refusal(f"lacks the option '{name}'")
        return [part for part in self.options[name].split(",") if part]

    def _whole(self, name: str, value: str | int) -> int:
        try:
            return int(value)
        except ValueError:
            raise self.refusal(f"has {name}={value}; this has to be a whole number") from None


def read_cfg(file: Path) -> list[Section]:
    """The sections in order.

    Spaces are ignored, `#` and `;` begin comments, and the first of repeated options counts.
    """
    sections = []
    for number, text in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        line = "".join(text.split())
        place = f"{file.name}, line {number}"
        if not line or line[0] in "#;":
            continue
        if line[0] == "[" and line[-1] == "]":
            sections.append(Section(line[1:-1], place))
            continue
        name, equals, value = line.partition("=")
        if not equals or not sections:
            raise ConversionError(
                f"{place}: '{text.strip()}' is not an option of a section; is this a darknet .cfg file?"
            )
        sections[-1].options.setdefault(name, value)
    return sections


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
