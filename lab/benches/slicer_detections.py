"""Detections of `supervision`'s InferenceSlicer in a data set, as COCO results: `DATA_SET SLICE OUT.json`.

.setup/benches/slicer/bin/python lab/benches/slicer_detections.py DATA_SET 640 slices_640.json
lookdown eval DATA_SET --from-detections slices_640.json
"""

import json
import sys
from pathlib import Path

from harness.lookdown import MODEL
from harness.places import PEERS, model

sys.path.insert(0, str(PEERS / "slicer"))
from detector import Detector  # noqa: E402

SCORE = 0.05
"""Lower than in the server, as `lookdown eval` needs it for average precision."""


def main(data_set: Path, side: int, out: Path) -> None:
    """Writes the detections of all images."""
    slicer = Detector(str(model(MODEL)), side, threads=1, workers=1, score=SCORE)
    found = []
    for image in json.loads((data_set / "annotations.json").read_text())["images"]:
        for person in slicer.detect((data_set / "images" / image["file_name"]).read_bytes()):
            left, top, right, bottom = person["box"].values()
            bbox = [left, top, right - left, bottom - top]
            found.append({"image_id": image["id"], "category_id": 1, "bbox": bbox, "score": person["score"]})
    out.write_text(json.dumps(found))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
