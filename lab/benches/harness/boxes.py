"""Matches the boxes of two responses."""

SAME_IOU = 0.5
"""The minimum IoU of boxes of the same person."""


def boxes(answer: dict) -> list[list[float]]:
    """Reads the boxes of a response."""
    sides = ("x_min", "y_min", "x_max", "y_max")
    return [[person["box"][side] for side in sides] for person in answer["persons"]]


def matched(mine: list[list[float]], other: list[list[float]]) -> list[float]:
    """IoUs of pairs, the best pairs first, each box in one pair."""
    pairs = sorted(((iou(a, b), i, j) for i, a in enumerate(mine) for j, b in enumerate(other)), reverse=True)
    taken: set[tuple[str, int]] = set()
    found = []
    for overlap, i, j in pairs:
        pair = {("mine", i), ("other", j)}
        if overlap >= SAME_IOU and taken.isdisjoint(pair):
            taken |= pair
            found.append(overlap)
    return found


def iou(a: list[float], b: list[float]) -> float:
    """The IoU of two boxes."""
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    shared = max(width, 0.0) * max(height, 0.0)
    areas = sum((box[2] - box[0]) * (box[3] - box[1]) for box in (a, b))
    return shared / (areas - shared) if shared else 0.0
