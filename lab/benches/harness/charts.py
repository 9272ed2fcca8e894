"""Charts of the results."""

from collections.abc import Sequence

import matplotlib.pyplot as plt

from .places import CHARTS

plt.switch_backend("Agg")


def bars(name: str, title: str, unit: str, values: dict[str, float]) -> str:
    """Draws a horizontal bar per name; returns the Markdown of the image."""
    figure, axes = plt.subplots(figsize=(7, 0.6 + 0.4 * len(values)))
    shown = axes.barh(list(values), list(values.values()), color="#3b6ea5")
    axes.bar_label(shown, fmt=" %.3g")
    axes.invert_yaxis()
    axes.set_xlabel(unit)
    axes.margins(x=0.15)
    return _save(figure, name, title)


def lines(
    name: str,
    title: str,
    labels: tuple[str, str],
    series: dict[str, Sequence[tuple[float, float]]],
    logarithmic: bool = False,
) -> str:
    """Draws a line per series; returns the Markdown of the image."""
    figure, axes = plt.subplots(figsize=(7, 3.6))
    for label, points in series.items():
        axes.plot(*zip(*points, strict=True), marker="o", label=label)
    if logarithmic:
        axes.set_xscale("log")
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    if len(series) > 1:
        axes.legend()
    return _save(figure, name, title)


def _save(figure, name: str, title: str) -> str:
    CHARTS.mkdir(parents=True, exist_ok=True)
    figure.axes[0].set_title(title)
    # Without the version of the library, the same figures give the same file.
    figure.savefig(CHARTS / f"{name}.png", dpi=110, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)
    return f"![{title}](charts/{name}.png)\n"
