"""Measures all of a frame but the network: decoding, rendering, merging, HTTP.

`host_side.py [SECONDS]`, after `packaging/scripts/setup.py benches` and `cargo build --release -p lookdown -p lookdown-load`.
The network costs nothing: it reads one value of each view and returns constant boxes, none or some. With boxes, the second pass has crops. The default models are measured for comparison. A frame's CPU time is that of
the server's process in a closed loop; the rate of 16 cores is extrapolated from it. Prints JSON, one line per network
and profile.
"""

import json
import os
import sys
from pathlib import Path

import numpy as np
from harness.frames import frame
from harness.load import steady
from harness.lookdown import ROOMY, detect, lookdown, report
from harness.places import WORK
from onnx import TensorProto, helper, numpy_helper
from parts.whole import stages_of

PROFILES = ("fast", "balanced")
BOXES = (None, 0, 4, 16, 100)
"""The boxes that the network returns for each view; none for the default models."""
CORES = len(os.sched_getaffinity(0))
MANY_CORES = 16
FRAMES = 30
SIDE = 416
"""The side of the input, as of NanoDet-g, pixels."""
SCORES = (0.9, 0.6, 0.3, 0.1)
"""The scores of the boxes, repeated: both sides of the score threshold."""


def main(seconds: float) -> None:
    for boxes in BOXES:
        network = {} if boxes is None else {"MODEL__PATH": str(free_network(boxes))}
        with lookdown(ROOMY | network) as server:
            for profile in PROFILES:
                path, jpeg = detect(profile), frame()
                stages = stages_of(server, path, FRAMES)
                answer = report(server, path, jpeg)
                loop = steady(
                    server, [path], jpeg, clients=2 * CORES, seconds=seconds, frame_seconds=stages["total"] / 1000
                )
                cpu_ms = loop["cpu_seconds_per_frame"] * 1000
                line = {
                    "profile": profile,
                    "network": "default" if boxes is None else f"{boxes} boxes per view",
                    "views": answer["views"],
                    "persons": len(answer["persons"]),
                    "stages_ms": {name: round(value, 2) for name, value in stages.items()},
                    "cores": CORES,
                    "cores_used": round(loop["cores"], 2),
                    "frames_per_second": round(loop["succeeded_per_second"], 1),
                    "cpu_ms_per_frame": round(cpu_ms, 1),
                    f"frames_per_second_of_{MANY_CORES}_cores": round(MANY_CORES * 1000 / cpu_ms),
                }
                print(json.dumps(line), flush=True)


def free_network(boxes: int) -> Path:
    """The ONNX file of a network that reads one value of each view and returns the same boxes for all views."""
    file = WORK / f"free-{boxes}.onnx"
    WORK.mkdir(parents=True, exist_ok=True)
    # The server loads a graph without boxes, too, but this one has the same shape of outputs for both.
    count = max(boxes, 1)
    scores = np.resize(np.array(SCORES, np.float32), count)
    if boxes == 0:
        scores[:] = 0
    tensors = {
        "begin": np.zeros(3, np.int64),
        "end": np.ones(3, np.int64),
        "axes": np.array([1, 2, 3], np.int64),
        "zero": np.zeros((), np.float32),
        "per_view": np.array([-1, 1], np.int64),
        "last": np.array([2], np.int64),
        "all_scores": scores.reshape(1, count),
        "all_boxes": upright_boxes(count).reshape(1, count, 4),
    }
    nodes = [
        helper.make_node("Slice", ["images", "begin", "end", "axes"], ["one"]),
        helper.make_node("Mul", ["one", "zero"], ["nothing"]),
        helper.make_node("Reshape", ["nothing", "per_view"], ["column"]),
        helper.make_node("Add", ["column", "all_scores"], ["scores"]),
        helper.make_node("Unsqueeze", ["column", "last"], ["deep"]),
        helper.make_node("Add", ["deep", "all_boxes"], ["boxes"]),
    ]
    graph = helper.make_graph(
        nodes,
        "free",
        [_value("images", ["views", 3, SIDE, SIDE])],
        [_value("boxes", ["views", count, 4]), _value("scores", ["views", count])],
        [numpy_helper.from_array(value, name) for name, value in tensors.items()],
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    file.write_bytes(made.SerializeToString())
    return file


def upright_boxes(count: int) -> np.ndarray:
    """Boxes of standing persons, in a grid over a view."""
    columns = int(np.ceil(np.sqrt(count)))
    row, column = np.divmod(np.arange(count), columns)
    step = SIDE / columns
    width, height = step / 3, min(step * 0.8, 150.0)
    left, top = column * step + width, row * step + step * 0.1
    return np.stack([left, top, left + width, top + height], axis=1).astype(np.float32)


def _value(name, shape):
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
