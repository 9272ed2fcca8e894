"""Draws how often persons of a score are right: `reliability_diagram.py OUT.svg DATASET DETECTIONS...`.

DETECTIONS are files of `lookdown eval DATASET --save-detections FOLDER`. A person is right with an IoU of 0.5 or more with
a true box that no better one has; those in a crowd do not count. Prints the expected calibration error of each file: the
mean difference between score and share of right persons in ten bins, weighted by their persons (Guo et al., "On Calibration
of Modern Neural Networks", ICML 2017). Needs the packages of lab/benches/count/requirements.txt.
"""

import json
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from count.measure_detector import FLOOR, judged
from matplotlib import pyplot

BINS = 10


def persons_of(dataset, path):
    """The scores of the persons from the floor on, and whether each is right."""
    detections = json.loads(Path(path).read_text(encoding="utf-8"))
    kept = [one for one in detections if one["score"] >= FLOOR]
    rows = [(score, overlap is not None) for score, overlap, _ in judged(dataset, kept)]
    scores, right = zip(*rows, strict=True)
    return np.array(scores), np.array(right)


def binned(scores, right):
    """Of each bin with persons: the number, the mean score, and the share of right ones."""
    bins = np.minimum((scores * BINS).astype(int), BINS - 1)
    return np.array([[(bins == b).sum(), scores[bins == b].mean(), right[bins == b].mean()] for b in np.unique(bins)])


def error_of(scores, right):
    """The expected calibration error."""
    counts, means, shares = binned(scores, right).T
    return np.average(np.abs(means - shares), weights=counts)


def error_by_chance(scores):
    """The mean error of a detector whose scores are exact probabilities, with as many persons."""
    chance = np.random.default_rng(1)
    return np.mean([error_of(scores, chance.random(len(scores)) < scores) for _ in range(500)])


def main():
    """Prints the errors and writes the diagram."""
    out, dataset, *files = sys.argv[1:]
    # The same figures give the same file.
    mpl.rcParams.update({"svg.hashsalt": "lookdown", "svg.fonttype": "none"})
    figure, axes = pyplot.subplots(figsize=(4.6, 4.4), layout="constrained")
    axes.plot([0, 1], [0, 1], color="0.6", linestyle="--", linewidth=1)
    for path in files:
        scores, right = persons_of(dataset, path)
        _, means, shares = binned(scores, right).T
        error, name = error_of(scores, right), Path(path).name.split(".")[0]
        print(
            f"{name}: expected calibration error {error:.3f} ({error_by_chance(scores):.3f} by chance), {len(scores)} persons"
        )
        axes.plot(means, shares, marker="o", markersize=4, label=f"{name}, ECE {error:.3f}")
    axes.set(xlabel="score", ylabel="share of right persons", xlim=(0, 1), ylim=(0, 1))
    axes.legend(loc="upper left", frameon=False)
    figure.savefig(out, metadata={"Date": None})


if __name__ == "__main__":
    main()
