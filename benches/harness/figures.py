"""What many measurements of one thing say together."""

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
        """For a raw file."""
        return asdict(self)


def spread(values: Sequence[float]) -> Spread:
    """Of at least one value."""
    return Spread(median(values), min(values), max(values), len(values))


def ratios(ours: Sequence[float], theirs: Sequence[float]) -> Spread:
    """Ours by theirs, round by round: what disturbs a whole round leaves its ratio alone."""
    return spread([our / their for our, their in zip(ours, theirs, strict=True)])


def growth(values: Sequence[float]) -> float:
    """How much greater the last quarter is than the second one, medians; the first one is the warm-up."""
    quarter = max(len(values) // 4, 1)
    return median(values[-quarter:]) - median(values[quarter : 2 * quarter] or values[:1])


def round_to(value: float, digits: int = 3) -> str:
    """With so many significant digits, and no more decimals than they need."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{decimals}f}"
