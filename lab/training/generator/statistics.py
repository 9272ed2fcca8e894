"""Prints what composed frames look like in numbers, to compare with real images."""

import json

import numpy as np

from .geometry import circle_radius


def print_statistics(folder):
    """Persons a frame, angles from straight down, sizes relative to the circle, and shares of kinds."""
    data = json.loads((folder / "annotations.json").read_text())
    diameters = {
        image["id"]: 2
        * circle_radius(json.loads((folder / "calibrations" / f"{image['calibration']}.json").read_text())["lens"])
        for image in data["images"]
    }
    counted = [a for a in data["annotations"] if not a["ignore"]]
    a_frame = [sum(a["image_id"] == image["id"] for a in counted) for image in data["images"]]
    spread = lambda values: "10 % {:.3g}, median {:.3g}, 90 % {:.3g}".format(
        *tuple(np.percentile(values, (10, 50, 90)))
    )
    print(
        f"{len(data['images'])} frames, {len(counted)} persons, {len(data['annotations']) - len(counted)} ignored, {len(data['distractors'])} distractors"
    )
    print("persons a frame:", spread(a_frame))
    print("degrees from straight down:", spread([a["nadir_deg"] for a in counted]))
    print(
        "square root of the box's area over the circle's diameter:",
        spread([(a["bbox"][2] * a["bbox"][3]) ** 0.5 / diameters[a["image_id"]] for a in counted]),
    )
    print("visible share:", spread([a["visible_fraction"] for a in counted]))
    print(
        "oriented box against the radius, degrees:",
        spread([abs((a["obb"][4] - a["upright_deg"] + 90) % 180 - 90) for a in counted]),
    )
    for field, of in (("pose", lambda a: a["pose"]), ("child", lambda a: a["child"])):
        values, counts = np.unique([str(of(a)) for a in counted], return_counts=True)
        print(field + ":", ", ".join(f"{v} {c / len(counted):.0%}" for v, c in zip(values, counts)))
    looks, counts = np.unique([image["look"]["kind"] for image in data["images"]], return_counts=True)
    print("look:", ", ".join(f"{v} {c / len(data['images']):.0%}" for v, c in zip(looks, counts)))
