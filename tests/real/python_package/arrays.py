"""Detects persons in a file and in its pixels: `arrays.py IMAGE CALIBRATION`. Prints `equal` if they are the same.

The file is made a PNG first, because decoders of JPEG differ by a level.
"""

import sys
from pathlib import Path

import cv2
import lookdown

image, calibration = sys.argv[1:]
bgr = cv2.imread(image)
png = Path("frame.png")
cv2.imwrite(str(png), bgr)
detector = lookdown.Detector(profile="fast")
of_file = detector.detect(png, calibration)
of_bgr = detector.detect(bgr, calibration, channel_order="BGR")
of_rgb = detector.detect(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), lookdown.Calibration.read(calibration))
persons = [detections.report["persons"] for detections in (of_file, of_bgr, of_rgb)]
assert len(of_file) > 0
print("equal" if persons[0] == persons[1] == persons[2] else persons)
