"""Reads annotation files with the packages of labeling tools: `readers.py FOLDER SAMPLES SERVER`. Prints JSON."""

import importlib.util
import json
import logging
import sys
from pathlib import Path
from types import SimpleNamespace

import cvat_sdk.auto_annotation as cvataa
import cvat_sdk.models as models
import PIL.Image
import supervision as sv
from cvat_sdk.auto_annotation.driver import _AnnotationMapper
from label_studio_sdk.label_interface import LabelInterface

ROOT = Path(__file__).resolve().parents[3]
LABEL = 77
"""The ID of the label `person` in a project of CVAT."""


def obb(folder: Path, samples: Path) -> dict:
    """The corners of the YOLO OBB labels, as supervision reads them."""
    labels = folder / "yolo"
    data = sv.DetectionDataset.from_yolo(str(samples), str(labels / "labels"), str(labels / "data.yaml"), is_obb=True)
    corners = {Path(path).name: found.data["xyxyxyxy"].tolist() for path, _, found in data}
    return {"classes": data.classes, "corners": corners}


def label_studio(folder: Path) -> dict:
    """The tasks, with the errors that Label Studio's own check of their predictions finds."""
    text = (ROOT / "docs" / "evaluate.md").read_text(encoding="utf-8")
    config = text[text.index("    <View>") : text.index("</View>") + len("</View>")]
    interface = LabelInterface(config)
    interface.validate()
    tasks = json.loads((folder / "labelstudio" / "tasks.json").read_text(encoding="utf-8"))
    backend = json.loads((folder / "predictions.json").read_text(encoding="utf-8"))["results"]
    predictions = [task["predictions"][0] for task in tasks] + backend
    # The check of a task with predictions fails in the package itself, so they are checked one by one.
    errors = [interface.validate_prediction(prediction, return_errors=True) for prediction in predictions]
    return {"tasks": [interface.validate_task({"data": task["data"]}) for task in tasks], "errors": sum(errors, [])}


def cvat(samples: Path, server: str) -> list:
    """The shapes that CVAT's driver makes of those of the example."""
    spec = importlib.util.spec_from_file_location("cvat_function", ROOT / "docs" / "examples" / "cvat_function.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    function = module.create(server=server, calibration="office", profile="fast")
    context = SimpleNamespace(frame_name="office.jpg", conf_threshold=0.5, conv_mask_to_poly=False)
    shapes = function.detect(context, PIL.Image.open(samples / "office.jpg"))
    label = models.Label(name="person", id=LABEL, type="rectangle", attributes=[], sublabels=[])
    mapper = _AnnotationMapper(
        logging.getLogger(), function.spec.labels, [label], allow_unmatched_labels=False, conv_mask_to_poly=False
    )
    tags, shapes = mapper.validate_and_remap(shapes, 3)
    assert not tags and isinstance(function.spec, cvataa.DetectionFunctionSpec)
    return [
        {"type": str(shape.type), "label": shape.label_id, "frame": shape.frame, "points": shape.points}
        | {"rotation": shape.rotation}
        for shape in shapes
    ]


if __name__ == "__main__":
    folder, samples = Path(sys.argv[1]), Path(sys.argv[2])
    found = {
        "obb": obb(folder, samples),
        "label_studio": label_studio(folder),
        "cvat": cvat(samples, sys.argv[3]),
    }
    print(json.dumps(found))
