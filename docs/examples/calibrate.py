# %% [markdown]
# # A calibration from the frames of a ceiling camera
# `calibrate.py FRAME...`: finds lens, center and tilt from the straight edges of the room, and writes
# `camera.json` and `preview.jpg`. Needs the Python package of docs/python.md.

# %% Several frames of one camera, of different times and with the lights on.
import json
import sys
from pathlib import Path

import lookdown

frames = sys.argv[1:]

# %% The frames may not determine the camera. The error says why, and what to do.
try:
    calibration, preview = lookdown.calibrate(frames, height_m=2.8)
except lookdown.LookdownError as refusal:
    sys.exit(f"not calibrated: {refusal}")

# %% The values with their standard deviations: percent of the radius, pixels, degrees.
for name, source in json.loads(calibration.to_json())["sources"].items():
    print(name, source["source"], source.get("uncertainty", ""))

# %% Look at the views: above with an assumed lens, below with the found one. Walls must be straight and upright.
Path("preview.jpg").write_bytes(preview)
Path("camera.json").write_text(calibration.to_json())

# %% Use it: persons with positions on the floor, in meters.
detections = lookdown.Detector(profile="fast").detect(frames[0], calibration)
print(detections.floor)
