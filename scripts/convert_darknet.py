"""Turns a darknet detector of the YOLOv2 or YOLOv3 family, the tiny ones too, into a model folder for Lookdown."""

import argparse
import sys

from assets.conversion import command_line, main

SOURCES = {"cfg": "the network's .cfg file", "weights": "its .weights file"}
NOTE = "The published yolov3-tiny.cfg has a wrong `mask`: make it 1,2,3 in its last section."


def convert(options: argparse.Namespace) -> str:
    """Converts, and prints the result."""
    # Imported here, because only the private environment has the packages.
    from convert.darknet.detector import convert_detector

    name = options.name or options.folder.resolve().name
    return convert_detector(options.cfg, options.weights, options.folder, name, options.class_names)


if __name__ == "__main__":
    options = command_line(__doc__, SOURCES, NOTE).parse_args()
    sys.exit(main(__file__, lambda: convert(options)))
