"""Detects persons in images of ceiling-mounted fisheye cameras.

>>> detector = lookdown.Detector(profile="fast")
>>> calibration = lookdown.Calibration.read("lobby.json")
>>> detections = detector.detect("frame.jpg", calibration)
>>> detections.boxes  # (N, 4): x_min, y_min, x_max, y_max
"""

import os

# ONNX Runtime reads this when it is loaded; otherwise the builds on PyPI record telemetry.
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")

from lookdown._lookdown import Calibration, Lens, LookdownError, View
from lookdown.calibrating import calibrate
from lookdown.counting import count
from lookdown.detections import Detections
from lookdown.detector import Detector
from lookdown.evaluation import evaluate

__all__ = ["Calibration", "Detections", "Detector", "Lens", "LookdownError", "View", "calibrate", "count", "evaluate"]
