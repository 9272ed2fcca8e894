"""Compares the rendering of views with OpenCV's remap (bilinear, fixed-point maps) and blobFromImages.

`against_opencv.py [ROUNDS]`, after `packaging/scripts/setup.py benches`. Both sides render the same 24 views of the same
frame at the same positions, on one thread each, in turns, view by view; the ratio is the median over all turns of
ours / theirs, so that whatever else the machine does meets both. Prints JSON, one line per view size.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SIDES = (300, 416)
# The scaling of `answer_rounds` in remap.rs.
SCALE = 1 / 57
MEAN = (103.5, 116.3, 123.7)


def main(rounds: int) -> None:
    cv2.setNumThreads(1)
    for side in SIDES:
        with tempfile.TemporaryDirectory() as folder:
            print(json.dumps(compare(Path(folder), side, rounds)), flush=True)


def compare(folder: Path, side: int, rounds: int) -> dict:
    command = ["cargo", "bench", "--locked", "--quiet", "--bench", "remap", "--", "rounds", str(folder), str(side)]
    with subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as ours:
        views, frame_side = map(int, ours.stdout.readline().split())
        frame = np.fromfile(folder / "frame.rgb", np.uint8).reshape(frame_side, frame_side, 3)
        positions = np.fromfile(folder / "positions.f32", np.float32).reshape(views, side, side, 2)
        maps = [cv2.convertMaps(at[..., 0].copy(), at[..., 1].copy(), cv2.CV_16SC2) for at in positions]
        blob = np.empty((views, 3, side, side), np.float32)
        rendered = np.empty((side, side, 3), np.uint8)
        times = []
        for view in list(range(views)) * rounds:
            ours.stdin.write(f"{view}\n")
            ours.stdin.flush()
            our_time = int(ours.stdout.readline()) / 1e9
            started = time.perf_counter()
            cv2.remap(frame, *maps[view], cv2.INTER_LINEAR, dst=rendered)
            remapped = time.perf_counter()
            found = cv2.dnn.blobFromImages([rendered], SCALE, (side, side), MEAN, swapRB=False)
            ended = time.perf_counter()
            blob[view] = found[0]
            times.append((our_time, ended - started, remapped - started))
        ours.stdin.close()
        if ours.wait() != 0:
            sys.exit("cargo bench failed; its message is above")
    found = np.fromfile(folder / "views.f32", np.float32).reshape(blob.shape)
    our_time, their_time, their_remap = np.array(times).T * 1e6
    return {
        "view": f"{side}x{side}",
        "rounds": rounds,
        "ours_us": round(float(np.median(our_time)), 1),
        "opencv_us": round(float(np.median(their_time)), 1),
        "of_it_remap_us": round(float(np.median(their_remap)), 1),
        "ratio": round(float(np.median(our_time / their_time)), 3),
        "ratio_of_least": round(float(our_time.min() / their_time.min()), 3),
        "ours_least_us": round(float(our_time.min()), 1),
        "opencv_least_us": round(float(their_time.min()), 1),
        # OpenCV's weights are multiples of 1/32, and the frame is noise: expect one or two levels.
        "mean_difference_levels": round(float(np.abs(found - blob).mean() / SCALE), 2),
        "opencv": cv2.__version__,
    }


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
