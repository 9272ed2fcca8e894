# %% [markdown]
# # From a fisheye frame to persons
# `example.py SAMPLES`: reads a calibration, straightens a part of the frame, detects persons and draws them.

# %% Read a calibration: any of the formats of docs/calibrate.md.
import sys
from pathlib import Path

import cv2
import lookdown
import numpy as np

samples = Path(sys.argv[1])
calibration = lookdown.Calibration.read(samples / "calibrations" / "office.json")
frame = cv2.imread(str(samples / "office.jpg"))
assert frame is not None
print(calibration, calibration.lens)

# %% Straighten: a pinhole view of 640×480 pixels and 90°, tilted by 40° from the optical axis.
width, height = 640, 480
focal = width / 2 / np.tan(np.radians(45))
columns, rows = np.meshgrid(np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2)
tilt = np.radians(40)
# Columns: the view's right, down and forward in the camera frame. The nadir is below.
right, forward = np.array([1.0, 0.0, 0.0]), np.array([0.0, -np.sin(tilt), np.cos(tilt)])
view = np.stack([right, np.cross(forward, right), forward], axis=1)
rays = np.stack([columns, rows, np.full_like(columns, focal)], axis=-1).reshape(-1, 3) @ view.T
pixels = calibration.lens.project(np.ascontiguousarray(rays)).astype(np.float32).reshape(height, width, 2)
straightened = cv2.remap(frame, pixels[..., 0], pixels[..., 1], cv2.INTER_LINEAR)
cv2.imwrite("straightened.png", straightened)

# %% Detect: boxes, oriented boxes, scores, positions on the floor.
detector = lookdown.Detector(profile="fast", score_threshold=0.3)
detections = detector.detect(frame, calibration, channel_order="BGR")
for score, floor in zip(detections.scores, detections.floor, strict=True):
    print(f"score {score:.2f} at {floor[0]:.1f} m, {floor[1]:.1f} m")

# %% Draw the oriented boxes.
for corners in detections.corners():
    cv2.polylines(frame, [corners.round().astype(np.int32)], isClosed=True, color=(0, 200, 255), thickness=2)
cv2.imwrite("persons.png", frame)

# %% Other libraries: COCO results, and supervision.
print(detections.to_coco(image_id=1)[0])
assert len(detections.to_supervision()) == len(detections)
