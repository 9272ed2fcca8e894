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

# %% Straighten: the first upright view of the profile.
detector = lookdown.Detector(profile="fast", score_threshold=0.3)
view = detector.views(calibration)[0]
map_x, map_y = view.maps()
straightened = cv2.remap(frame, map_x, map_y, cv2.INTER_LINEAR)
cv2.imwrite("straightened.png", straightened)

# %% Detect: boxes, oriented boxes, scores, positions on the floor.
detections = detector.detect(frame, calibration, channel_order="BGR")
for score, floor in zip(detections.scores, detections.floor, strict=True):
    print(f"score {score:.2f} at {floor[0]:.1f} m, {floor[1]:.1f} m")

# %% Draw the oriented boxes.
for corners in detections.corners():
    cv2.polylines(frame, [corners.round().astype(np.int32)], isClosed=True, color=(0, 200, 255), thickness=2)
cv2.imwrite("persons.png", frame)

# %% Calibrate: a camera that looks straight down needs its lens.
found, preview = lookdown.calibrate(samples / "office.jpg", lens="equidistant", height_m=2.9)
assert abs(found.lens.project(np.array([[0.0, 1.0, 1.0]]))[0, 1] - 719.5) < 10, found.lens
assert preview.startswith(b"\xff\xd8")
for wrong in ({"lens": "pinhole"}, {"field_of_view_deg": 20.0}):
    try:
        lookdown.calibrate(samples / "office.jpg", **wrong)
    except lookdown.LookdownError as error:
        assert next(iter(wrong)) in str(error)

# %% Other libraries: COCO results, and supervision.
print(detections.to_coco(image_id=1)[0])
assert len(detections.to_supervision()) == len(detections)

# %% A notebook shows the frame with the persons. Tables, polygons and GeoJSON.
shown = detections._repr_html_()
assert shown is not None and shown.count("<polygon") == len(detections)
assert detections.to_pandas()["score"].is_monotonic_decreasing
assert all(polygon.is_valid for polygon in detections.to_shapely())
assert len(detections.to_geojson()["features"]) == len(detections)

# %% Files are shown as they are. Persons without a frame have no figure.
shown = detector.detect(samples / "office.jpg", calibration)._repr_html_()
assert shown is not None and "data:image/jpeg;base64," in shown
assert lookdown.Detections(detections.report)._repr_html_() is None

# %% Counts of recordings are a table; a recording that is missing is one sentence.
try:
    lookdown.count("missing.mp4", calibration=samples / "calibrations" / "office.json")
except lookdown.LookdownError as error:
    assert "missing.mp4" in str(error)
