"""The limit: the same runs of the same networks through bare ONNX Runtime on ready tensors, alternating with the server."""

import os
import subprocess

from harness.effort import Effort
from harness.figures import ratios, spread, spread_cell, table
from harness.frames import frame
from harness.load import load
from harness.lookdown import CROP_MODEL, MODEL, ROOMY, detect, lookdown, runs_of
from harness.places import BENCHES, model, python_of
from harness.processes import BenchError

PROFILE = "balanced"
INPUT_SIDE = 416
CLIENTS = 8
BATCHES = (1, 4, 8, 24)


def measure(effort: Effort) -> dict:
    """Searches for the best bare settings, then alternates."""
    path = detect(PROFILE)
    with lookdown(ROOMY) as server:
        runs = dict(zip((MODEL, CROP_MODEL), runs_of(server, PROFILE), strict=True))
        tried = {
            f"{sessions} × {threads} threads, batch {batch}": (sessions, threads, batch)
            for sessions, threads in shares()
            for batch in BATCHES
        }
        tuning = {name: bare(runs, *setting, effort.tune_seconds) for name, setting in tried.items()}
        best = max(tuning, key=tuning.__getitem__)
        ours, theirs = [], []
        for _ in range(effort.rounds):
            theirs.append(bare(runs, *tried[best], effort.seconds))
            result = load(server, [path], frame(), clients=CLIENTS, warm_up=2.0, seconds=effort.seconds)
            ours.append(result["succeeded_per_second"])
    return {"runs": runs, "tuning": tuning, "best": best, "ours": ours, "bare": theirs}


def shares() -> list[tuple[int, int]]:
    """The divisions of the cores: sessions and threads of each."""
    cores = len(os.sched_getaffinity(0))
    ways = [(1, cores), (cores, 1)] + ([(2, cores // 2)] if cores > 3 else [])
    return list(dict.fromkeys(ways))


def bare(runs: dict[str, int], sessions: int, threads: int, batch: int, seconds: float) -> float:
    """Frames per second in a process of its own."""
    models = [f"{model(name)}:{count}" for name, count in runs.items()]
    command = [python_of("benches"), BENCHES / "bare_onnx.py", INPUT_SIDE, sessions, threads, batch, seconds, *models]
    answer = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if answer.returncode != 0:
        raise BenchError(f"bare_onnx.py failed: {answer.stderr.strip()}")
    return float(answer.stdout)


def tell(raw: dict) -> str:
    """The ratio as Markdown."""
    rows = [
        ("`/detect`, frames/s", spread_cell(spread(raw["ours"]))),
        (f"bare ONNX Runtime ({raw['best']}), frames/s", spread_cell(spread(raw["bare"]))),
        ("**ratio, round by round**", spread_cell(ratios(raw["ours"], raw["bare"]))),
    ]
    runs = " and ".join(f"{count} of {name}" for name, count in raw["runs"].items())
    return f"`{PROFILE}`, runs of a frame by the report of the server: {runs}; {CLIENTS} clients:\n\n" + table(
        ("", "median (range)"), rows
    )
