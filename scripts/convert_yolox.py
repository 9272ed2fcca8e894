"""Turns a PyTorch checkpoint of YOLOX, from nano to x, into a model folder for Lookdown; PyTorch is not needed."""

import argparse
import sys

from assets.conversion import command_line, main

SOURCES = {"checkpoint": "the .pth file"}
NOTE = "The network has to be one that takes pixels from 0 to 255, as those published since August 2021 do."


def convert(options: argparse.Namespace) -> str:
    """Converts, and prints the result."""
    # Imported here, because only the private environment has the packages.
    from convert.yolox import convert_detector

    name = options.name or options.folder.resolve().name
    return convert_detector(options.checkpoint, options.folder, options.size, name, options.class_names)


if __name__ == "__main__":
    parser = command_line(__doc__, SOURCES, NOTE)
    parser.add_argument("--size", type=int, default=640, help="sides of the input in pixels; 416 for nano and tiny")
    options = parser.parse_args()
    sys.exit(main(__file__, lambda: convert(options)))
