"""Statistics over repeated measurements."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from statistics import median


@dataclass(frozen=True)
class Spread:
    """A median with the least and the greatest value."""

    median: float
    least: float
    greatest: float
    count: int

    def as_json(self) -> dict:
        """The values for a raw file."""
        return asdict(self)


def spread(values: Sequence[float]) -> Spread:
    """Computes the spread of at least one value."""
    return Spread(median(values), min(values), max(values), len(values))


def ratios(ours: Sequence[float], theirs: Sequence[float]) -> Spread:
    """The ratios of both servers per round: a disturbance of a whole round does not change its ratio."""
    return spread([our / their for our, their in zip(ours, theirs, strict=True)])


def round_to(value: float, digits: int = 3) -> str:
    """Formats a number with `digits` significant digits and no further decimals."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{decimals}f}"
