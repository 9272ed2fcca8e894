"""Counts line crossings and draws a heat map with supervision, from the frames of one camera in order."""

import argparse
import json
from pathlib import Path
from urllib.parse import urlencode
from urllib.request import Request, urlopen

import cv2
import numpy as np
import supervision as sv

TIMEOUT_SECONDS = 60


class NearestTracker:
    """Gives a person the ID of the nearest person of the frame before."""

    def __init__(self, max_step: float) -> None:
        """`max_step` is the longest step between two frames, pixels."""
        self.max_step = max_step
        self.centers: dict[int, np.ndarray] = {}
        self.next_id = 1

    def update(self, detections: sv.Detections) -> sv.Detections:
        """Sets the tracker IDs."""
        ids, left = [], dict(self.centers)
        for center in detections.get_anchors_coordinates(sv.Position.CENTER):
            steps = {track: float(np.linalg.norm(center - other)) for track, other in left.items()}
            nearest = min(steps, key=steps.get, default=None)
            if nearest is None or steps[nearest] > self.max_step:
                nearest, self.next_id = self.next_id, self.next_id + 1
            left.pop(nearest, None)
            self.centers[nearest] = center
            ids.append(nearest)
        self.centers = {track: self.centers[track] for track in ids}
        detections.tracker_id = np.array(ids, dtype=int)
        return detections


def detect(frame: bytes, server: str, parameters: dict[str, str]) -> sv.Detections:
    """Returns the persons in a frame, with the corners of their oriented boxes."""
    request = Request(f"{server.rstrip('/')}/detect?{urlencode(parameters)}", data=frame)
    with urlopen(request, timeout=TIMEOUT_SECONDS) as answer:
        persons = json.load(answer)["persons"]
    sides = ("x_min", "y_min", "x_max", "y_max")
    boxes = [[person["box"][side] for side in sides] for person in persons]
    return sv.Detections(
        xyxy=np.array(boxes, dtype=np.float32).reshape(len(persons), 4),
        confidence=np.array([person["score"] for person in persons], dtype=np.float32),
        class_id=np.zeros(len(persons), dtype=int),
    )


def main() -> None:
    """Counts in the frames of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("frames", type=Path, nargs="+", help="JPEG or PNG files in order")
    parser.add_argument("--server", default="http://localhost:8080", help="address of Lookdown")
    parser.add_argument("--calibration", help="ID of the calibration of the camera")
    parser.add_argument("--profile", default="balanced", help="profile of the detection")
    parser.add_argument("--line", required=True, help="x1,y1,x2,y2 in pixels")
    parser.add_argument("--max-step", type=float, default=80.0, help="longest step between two frames, pixels")
    parser.add_argument("--heat-map", type=Path, help="file for the last frame with the heat map")
    options = parser.parse_args()
    parameters = {"profile": options.profile}
    if options.calibration:
        parameters["calibration"] = options.calibration
    x1, y1, x2, y2 = (float(number) for number in options.line.split(","))
    zone = sv.LineZone(sv.Point(x1, y1), sv.Point(x2, y2), triggering_anchors=[sv.Position.CENTER])
    heat = sv.HeatMapAnnotator(position=sv.Position.CENTER)
    tracker = NearestTracker(options.max_step)
    for path in options.frames:
        content = path.read_bytes()
        detections = tracker.update(detect(content, options.server, parameters))
        zone.trigger(detections)
        image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
        image = heat.annotate(image, detections)
    if options.heat_map:
        cv2.imwrite(str(options.heat_map), image)
    print(json.dumps({"in": zone.in_count, "out": zone.out_count, "frames": len(options.frames)}))


if __name__ == "__main__":
    main()
