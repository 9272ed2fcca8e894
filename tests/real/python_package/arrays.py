"""Detects persons in a file and in its pixels: `arrays.py IMAGE CALIBRATION`. Prints `equal` if they are the same.

The maps of the views are compared with the lens.

The file is made a PNG first, because decoders of JPEG differ by a level.
"""

import os
import sys
from pathlib import Path

import cv2
import lookdown
import numpy as np

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

lens = lookdown.Calibration.read(calibration).lens
for view in detector.views(calibration):
    # The pixel in the middle of an even number of columns is beside the principal point.
    (column, row), (x, y) = (round(at) for at in view.principal_point), view.principal_point
    ray = view.camera_from_view @ [(column - x) / view.focal, (row - y) / view.focal, 1.0]
    seen = lens.project(ray[np.newaxis])[0]
    mapped = [part[row, column] for part in view.maps()]
    assert np.allclose(seen, mapped, atol=1e-3, equal_nan=True), (seen, mapped)

# 30 GB, if they were copied.
huge = np.broadcast_to(np.uint8(0), (100_000, 100_000, 3))
# Neither ends.
os.mkfifo("pipe.jpg")
for unusable, reason in ((huge, "8192"), ("/dev/zero", "cannot be read"), ("pipe.jpg", "cannot be read")):
    try:
        detector.detect(unusable, calibration)
    except lookdown.LookdownError as refusal:
        assert reason in str(refusal), refusal
    else:
        raise AssertionError(f"{reason}: accepted")
try:
    lens.project(np.broadcast_to(1.0, (2**40, 3)))
except lookdown.LookdownError as refusal:
    assert "rows" in str(refusal), refusal
print("equal" if persons[0] == persons[1] == persons[2] else persons)
