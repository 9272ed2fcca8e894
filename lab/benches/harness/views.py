"""The views of the frame for the networks of other servers, rendered with OpenCV."""

import json
import sys
from pathlib import Path

import cv2
import numpy as np

from .frames import SIDE, calibration, frame
from .places import PEERS, WORK

sys.path.insert(0, str(PEERS / "plain_python"))
from views import Lens, View


def plan_file(plan: dict) -> Path:
    """A view plan as a file."""
    file = WORK / f"plan-{plan['profile']}.json"
    file.write_text(json.dumps(plan), encoding="utf-8")
    return file


def view_file(plan: dict, size: int) -> Path:
    """The views of the frame as bytes `[views, 3, size, size]`."""
    file = WORK / f"views-{plan['profile']}-{size}.npy"
    lens = Lens(json.loads(calibration().read_text(encoding="utf-8")), SIDE)
    rgb = cv2.cvtColor(cv2.imread(str(frame())), cv2.COLOR_BGR2RGB)
    np.save(file, np.stack([View(view, size, lens).render(rgb).transpose(2, 0, 1) for view in plan["views"]]))
    return file
