"""Statistics over repeated measurements, and Markdown tables of them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

ABSENT = "–"


@dataclass(frozen=True)
class Spread:
    """A median with the least and the greatest value."""

    median: float
    least: float
    greatest: float


def spread(values: Sequence[float]) -> Spread:
    """Computes the spread of at least one value."""
    return Spread(median(values), min(values), max(values))


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


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Formats a table with words in the first column and figures in the others."""
    lines = [_line(head), "|---|" + "---:|" * (len(head) - 1)]
    for row in rows:
        if len(row) != len(head):
            raise ValueError(f"a row of {len(row)} cells under a head of {len(head)}: {row}")
        lines.append(_line([_cell(value) for value in row]))
    return "\n".join(lines) + "\n"


def spread_cell(spread: Spread) -> str:
    """A median with its range."""
    return f"{round_to(spread.median)} ({round_to(spread.least)} to {round_to(spread.greatest)})"


def _cell(value: object) -> str:
    if value is None:
        return ABSENT
    if isinstance(value, float):
        return round_to(value)
    return str(value).replace("|", "\\|")


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"
