"""Markdown tables."""

from collections.abc import Iterable, Sequence

from .figures import round_to

ABSENT = "–"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Formats a table with words in the first column and figures in the others."""
    lines = [_line(head), "|---|" + "---:|" * (len(head) - 1)]
    for row in rows:
        if len(row) != len(head):
            raise ValueError(f"a row of {len(row)} cells under a head of {len(head)}: {row}")
        lines.append(_line([_cell(value) for value in row]))
    return "\n".join(lines) + "\n"


def spread_cell(spread: dict) -> str:
    """A median with its range."""
    parts = (round_to(spread[name]) for name in ("median", "least", "greatest"))
    return "{} ({} to {})".format(*parts)


def _cell(value: object) -> str:
    if value is None:
        return ABSENT
    if isinstance(value, float):
        return round_to(value)
    return str(value).replace("|", "\\|")


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"
