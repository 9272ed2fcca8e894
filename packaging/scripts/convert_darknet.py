"""Turns a darknet detector of the YOLOv2 or YOLOv3 family, the tiny ones too, into a model folder for Lookdown."""

import argparse
import sys
from pathlib import Path

from assets.conversion import HOW_TO_RUN, main

NOTE = (
    "OUT_FOLDER is then a model like those under models/; LOOKDOWN__MODEL__PATH=OUT_FOLDER selects it. The published "
    "yolov3-tiny.cfg has a wrong `mask`: make it 1,2,3 in its last section."
)


def arguments() -> argparse.Namespace:
    """The files, and the model's name and classes."""
    parser = argparse.ArgumentParser(description=__doc__, epilog=HOW_TO_RUN + NOTE)
    parser.add_argument("cfg", type=Path, metavar="CFG", help="the network's .cfg file")
    parser.add_argument("weights", type=Path, metavar="WEIGHTS", help="its .weights file")
    parser.add_argument("folder", type=Path, metavar="OUT_FOLDER", help="the folder for model.onnx and model.toml")
    parser.add_argument("--name", help="the model's name in reports; the folder's name by default")
    parser.add_argument(
        "--class-names",
        type=Path,
        metavar="FILE",
        help="the classes' names, one a line, one of them 'person'; not needed for 80 classes (COCO) and 20 (VOC)",
    )
    return parser.parse_args()


def convert(options: argparse.Namespace) -> str:
    """Converts, and prints the result."""
    # Imported here, because only the private environment has the packages.
    from convert.darknet.detector import convert_detector

    name = options.name or options.folder.resolve().name
    return convert_detector(options.cfg, options.weights, options.folder, name, options.class_names)


if __name__ == "__main__":
    options = arguments()
    sys.exit(main(__file__, lambda: convert(options)))
