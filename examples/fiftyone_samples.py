"""Adds the images of a folder to a data set of FiftyOne, with the persons that a Lookdown server detects."""

import argparse
import json
import math
from pathlib import Path
from urllib.parse import urlencode
from urllib.request import Request, urlopen

import fiftyone

TIMEOUT_SECONDS = 60
ENDINGS = {".jpg", ".jpeg", ".png", ".webp"}


def sample_of(image: Path, server: str, parameters: dict[str, str]) -> fiftyone.Sample:
    """Returns the image with its persons: axis-parallel boxes, and oriented boxes as polylines."""
    request = Request(f"{server.rstrip('/')}/detect?{urlencode(parameters)}", data=image.read_bytes())
    with urlopen(request, timeout=TIMEOUT_SECONDS) as answer:
        report = json.load(answer)
    size = (report["image"]["width"], report["image"]["height"])
    sample = fiftyone.Sample(filepath=str(image.resolve()))
    sample["persons"] = fiftyone.Detections(detections=[detection(person, size) for person in report["persons"]])
    sample["oriented"] = fiftyone.Polylines(polylines=[polyline(person, size) for person in report["persons"]])
    return sample


def detection(person: dict, size: tuple[int, int]) -> fiftyone.Detection:
    """Returns the axis-parallel box, as fractions of the sides."""
    box = person["box"]
    left, right = (box[side] / size[0] for side in ("x_min", "x_max"))
    top, bottom = (box[side] / size[1] for side in ("y_min", "y_max"))
    bounds = [left, top, right - left, bottom - top]
    return fiftyone.Detection(label="person", bounding_box=bounds, confidence=person["score"])


def polyline(person: dict, size: tuple[int, int]) -> fiftyone.Polyline:
    """Returns the corners of the oriented box, as fractions of the sides."""
    box = person["oriented_box"]
    sin, cos = math.sin(math.radians(box["angle_deg"])), math.cos(math.radians(box["angle_deg"]))
    corners = []
    for across, along in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
        x, y = across * box["width"], along * box["height"]
        corners.append(((box["cx"] + cos * x - sin * y) / size[0], (box["cy"] + sin * x + cos * y) / size[1]))
    return fiftyone.Polyline(label="person", points=[corners], closed=True, confidence=person["score"])


def main() -> None:
    """Adds the images of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of images")
    parser.add_argument("--server", default="http://localhost:8080", help="address of Lookdown")
    parser.add_argument("--calibration", help="ID of the calibration of all images")
    parser.add_argument("--dataset", default="lookdown", help="name of the data set")
    options = parser.parse_args()
    parameters = {"calibration": options.calibration} if options.calibration else {}
    images = sorted(path for path in options.folder.iterdir() if path.suffix.lower() in ENDINGS)
    dataset = fiftyone.Dataset(options.dataset, overwrite=True, persistent=True)
    dataset.add_samples([sample_of(image, options.server, parameters) for image in images])
    print(f"{len(dataset)} images in the data set {options.dataset}")


if __name__ == "__main__":
    main()
