"""The limit: as many views through bare ONNX Runtime on ready tensors, alternating with the server."""

import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
from harness.effort import Effort
from harness.figures import ratios, spread, spread_cell, table
from harness.frames import SIDE, calibration, frame
from harness.load import load
from harness.lookdown import MODEL, ROOMY, detect, lookdown, report, view_plan
from harness.places import BENCHES, PEERS, WORK, model, python_of
from harness.processes import BenchError

sys.path.insert(0, str(PEERS / "plain_python"))
from views import Lens, View  # noqa: E402

PROFILE = "balanced"
INPUT_SIDE = 416
CLIENTS = 8
BATCHES = (1, 4, 8, 24)


def measure(effort: Effort) -> dict:
    """Searches for the best bare settings, then alternates."""
    path = detect(PROFILE, model=MODEL)
    with lookdown(ROOMY) as server:
        plan = view_plan(server, PROFILE)
        views = view_file(plan, INPUT_SIDE)
        # The first frame builds the remap tables of the camera. Its crops count as views.
        count = report(server, path, frame())["views"]["inferred"]
        tried = {
            f"{sessions} × {threads} threads, batch {batch}": (sessions, threads, batch)
            for sessions, threads in shares()
            for batch in BATCHES
        }
        tuning = {name: bare(views, *setting, effort.tune_seconds) / count for name, setting in tried.items()}
        best = max(tuning, key=tuning.__getitem__)
        ours, theirs = [], []
        for _ in range(effort.rounds):
            theirs.append(bare(views, *tried[best], effort.seconds) / count)
            result = load(server, [path], frame(), clients=CLIENTS, warm_up=2.0, seconds=effort.seconds)
            ours.append(result["succeeded_per_second"])
    return {"views": count, "tuning": tuning, "best": best, "ours": ours, "bare": theirs}


def view_file(plan: dict, size: int) -> Path:
    """The views of the frame as bytes `[views, 3, size, size]`."""
    file = WORK / f"views-{plan['profile']}-{size}.npy"
    lens = Lens(json.loads(calibration().read_text(encoding="utf-8")), SIDE)
    rgb = cv2.cvtColor(cv2.imread(str(frame())), cv2.COLOR_BGR2RGB)
    np.save(file, np.stack([View(view, size, lens).render(rgb).transpose(2, 0, 1) for view in plan["views"]]))
    return file


def shares() -> list[tuple[int, int]]:
    """The divisions of the cores: sessions and threads of each."""
    cores = len(os.sched_getaffinity(0))
    ways = [(1, cores), (cores, 1)] + ([(2, cores // 2)] if cores > 3 else [])
    return list(dict.fromkeys(ways))


def bare(views, sessions: int, threads: int, batch: int, seconds: float) -> float:
    """Views per second in a process of its own."""
    command = [python_of("benches"), BENCHES / "bare_onnx.py", model(MODEL), views, sessions, threads, batch, seconds]
    answer = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if answer.returncode != 0:
        raise BenchError(f"bare_onnx.py failed: {answer.stderr.strip()}")
    return float(answer.stdout)


def tell(raw: dict) -> str:
    """The ratio as Markdown."""
    rows = [
        ("`/detect`, frames/s", spread_cell(spread(raw["ours"]).as_json())),
        (f"bare ONNX Runtime ({raw['best']}), frames/s", spread_cell(spread(raw["bare"]).as_json())),
        ("**ratio, round by round**", spread_cell(ratios(raw["ours"], raw["bare"]).as_json())),
    ]
    return (
        f"`{PROFILE}`, {MODEL}, {raw['views']} views per frame, {CLIENTS} clients, {len(raw['ours'])} rounds:\n\n"
        + table(("", "median (range)"), rows)
    )
