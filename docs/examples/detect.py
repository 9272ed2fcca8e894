"""Prints the persons of a frame: detect.py FRAME [SERVER]. Needs nothing but Python."""

import json
import sys
import urllib.request
from pathlib import Path

server = sys.argv[2] if len(sys.argv) > 2 else "http://localhost:8080"
frame = Path(sys.argv[1]).read_bytes()
request = urllib.request.Request(f"{server}/detect?score_threshold=0.3", frame, {"Content-Type": "image/jpeg"})
with urllib.request.urlopen(request, timeout=30) as answer:
    report = json.load(answer)
for person in report["persons"]:
    print(f"{person['score']:.2f}", person["box"])
