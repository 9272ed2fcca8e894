"""Reads annotation files with the tools of data sets, and writes them: `tools.py FOLDER`. Prints JSON.

`FOLDER` has `images` and a folder per format, as `lookdown detect --format` writes them. The layouts are those of
docs/evaluate.md.
"""

import json
import shutil
import sys
from pathlib import Path

import datumaro
import supervision as sv
from pycocotools.coco import COCO


def layouts(folder: Path) -> Path:
    """Copies the files into the folders that datumaro expects."""
    made = folder / "datumaro"
    shutil.copytree(folder / "images", made / "coco/images/default")
    (made / "coco/annotations").mkdir()
    shutil.copy(folder / "coco/annotations.json", made / "coco/annotations/instances_default.json")
    shutil.copytree(folder / "images", made / "cvat/images")
    shutil.copy(folder / "cvat/annotations.xml", made / "cvat/default.xml")
    shutil.copytree(folder / "voc", made / "voc")
    shutil.copytree(folder / "images", made / "yolo/images/train")
    shutil.copytree(folder / "yolo/labels", made / "yolo/labels/train")
    data = "path: .\ntrain: images/train\nnames: [person]\n"
    (made / "yolo/data.yaml").write_text(data, encoding="utf-8")
    return made


def read(folder: Path, made: Path) -> dict[str, int]:
    """The number of persons that each tool reads."""
    images, coco = str(folder / "images"), str(folder / "coco/annotations.json")
    yolo = (str(folder / "yolo/labels"), str(folder / "yolo/data.yaml"))
    by_supervision = {
        "supervision coco": sv.DetectionDataset.from_coco(images, coco),
        "supervision yolo": sv.DetectionDataset.from_yolo(images, *yolo),
        "supervision voc": sv.DetectionDataset.from_pascal_voc(images, str(folder / "voc/Annotations")),
    }
    found = {name: sum(len(persons) for _, _, persons in data) for name, data in by_supervision.items()}
    for name in ("coco", "cvat", "voc", "yolo"):
        data = datumaro.Dataset.import_from(str(made / name), name)
        found[f"datumaro {name}"] = sum(len(item.annotations) for item in data)
    return found | {"pycocotools coco": len(COCO(coco).anns)}


def write(folder: Path, made: Path) -> None:
    """Writes data sets with the tools."""
    data = datumaro.Dataset.import_from(str(made / "coco"), "coco")
    data.export(str(folder / "written/datumaro_coco"), "coco_instances", save_media=True)
    data.export(str(folder / "written/datumaro_voc"), "voc_detection", save_media=True)
    data = sv.DetectionDataset.from_coco(str(folder / "images"), str(folder / "coco/annotations.json"))
    coco, voc = folder / "written/supervision_coco", folder / "written/supervision_voc"
    data.as_coco(images_directory_path=str(coco / "images"), annotations_path=str(coco / "annotations.json"))
    data.as_pascal_voc(images_directory_path=str(voc / "images"), annotations_directory_path=str(voc / "annotations"))


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    made = layouts(folder)
    write(folder, made)
    print(json.dumps(read(folder, made)))
