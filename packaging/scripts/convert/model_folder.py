"""Writes a model folder for Lookdown: `model.onnx` and its manifest `model.toml`."""

import json
import os
from collections.abc import Callable
from pathlib import Path

from . import ConversionError

# The data sets COCO and Pascal VOC, identified by their number of classes, and their person class.
PERSON_BY_CLASSES = {80: 0, 20: 14}


def person_class(classes: int, class_names: Path | None) -> int:
    """The index of the person class, from a list of names or else from the number of classes."""
    if class_names is None:
        if classes not in PERSON_BY_CLASSES:
            raise ConversionError(f"Which of {classes} classes is the person? Give a list of names: --class-names FILE")
        return PERSON_BY_CLASSES[classes]
    names = [line.strip() for line in class_names.read_text(encoding="utf-8").splitlines() if line.strip()]
    if len(names) != classes or "person" not in names:
        raise ConversionError(f"{class_names.name} has {len(names)} names; {classes} are needed, one of them 'person'.")
    return names.index("person")


def write_model_folder(
    folder: Path, *, name: str, source: str, tables: list[str], save: Callable[[Path], None]
) -> None:
    """Writes the folder, the manifest last; `tables` are its further lines, `save` writes the ONNX file."""
    if (folder / "model.toml").exists():
        raise ConversionError(f"{folder} holds a model already; name another folder, or delete it.")
    folder.mkdir(parents=True, exist_ok=True)
    unfinished = folder / "model.onnx.unfinished"
    save(unfinished)
    os.replace(unfinished, folder / "model.onnx")
    lines = [
        "# The converter cannot know the license of the weights; write its SPDX identifier here.",
        'license = "NOASSERTION"',
        f"name = {json.dumps(name, ensure_ascii=False)}",
        'onnx = "model.onnx"',
        f"source = {json.dumps(source, ensure_ascii=False)}",
        *tables,
    ]
    (folder / "model.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
