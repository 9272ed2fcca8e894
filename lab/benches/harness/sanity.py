"""Checks that a peer detects the same persons as Lookdown."""

import json

from .boxes import boxes, matched
from .frames import frame
from .lookdown import MODEL, detect, report
from .processes import Server


def agreement(ours: Server, theirs: Server) -> list[dict]:
    """Compares the boxes of both servers with one plan and model, for two refinements of Lookdown."""
    other = boxes(json.loads(theirs.post("/detect", frame().read_bytes())))
    rows = []
    for refine in ("fusion", "nms"):
        mine = boxes(report(ours, f"{detect('balanced', model=MODEL)}&refine={refine}", frame()))
        overlaps = matched(mine, other)
        mean = sum(overlaps) / max(len(overlaps), 1)
        rows.append(
            {"refine": refine, "ours": len(mine), "theirs": len(other), "same": len(overlaps), "mean_iou": mean}
        )
    return rows
