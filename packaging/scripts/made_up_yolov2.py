"""Writes YOLOv2 (Pascal VOC, 416 x 416) with random weights, for tests and timing of the real size."""

import argparse
import sys
from pathlib import Path

from assets.conversion import main

SIZE = 416
CLASSES = 20
SEED = 2017


def write(folder: Path) -> str:
    """Writes yolov2.cfg and yolov2.weights, reproducibly, and prints their sizes."""
    # Imported here, because only the private environment has the packages.
    from convert.darknet.network import read_network
    from convert.tests.made_up_darknet import VOC_ANCHORS, write_weights, yolov2_cfg

    folder.mkdir(parents=True, exist_ok=True)
    cfg, weights = folder / "yolov2.cfg", folder / "yolov2.weights"
    cfg.write_text(yolov2_cfg(SIZE, VOC_ANCHORS, CLASSES), encoding="utf-8")
    write_weights(weights, read_network(cfg), SEED)
    return f"{cfg}, {weights}: {weights.stat().st_size / 1e6:.1f} MB"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, metavar="OUT_DIR", help="where yolov2.cfg and yolov2.weights go")
    options = parser.parse_args()
    sys.exit(main(__file__, lambda: write(options.folder)))
