"""Overload far beyond the capacity: the goodput, and the latency of refusals."""

from harness.effort import Effort
from harness.figures import spread
from harness.frames import frame
from harness.load import load
from harness.lookdown import detect, lookdown, report
from harness.tables import spread_cell, table

PROFILE = "balanced"
CLIENTS = 8
TIMES = 10


def measure(effort: Effort) -> dict:
    """Alternates capacity and overload with default settings."""
    paths, jpeg, rounds = [detect(PROFILE)], frame(), []
    with lookdown() as server:
        report(server, paths[0], jpeg)  # builds the remap tables of the camera
        for _ in range(effort.rounds):
            calm = load(server, paths, jpeg, clients=CLIENTS, warm_up=2.0, seconds=effort.seconds)
            rate = TIMES * calm["succeeded_per_second"]
            storm = load(server, paths, jpeg, rate=rate, warm_up=2.0, seconds=effort.seconds)
            rounds.append({"capacity": calm, "overload": storm})
    return {"rounds": rounds}


def tell(raw: dict) -> str:
    """Goodput and refusals as Markdown."""
    rounds = raw["rounds"]
    goodput = [turn["overload"]["succeeded_per_second"] / turn["capacity"]["succeeded_per_second"] for turn in rounds]
    rows = [
        ("capacity, frames/s", cell([turn["capacity"]["succeeded_per_second"] for turn in rounds])),
        ("**goodput ÷ capacity**", cell(goodput)),
        ("**p99 of refusals, ms**", cell([turn["overload"]["refused"].get("p99_ms", 0.0) for turn in rounds])),
        ("p99 of answers, ms", cell([turn["overload"]["succeeded"].get("p99_ms", 0.0) for turn in rounds])),
        ("refused", cell([float(turn["overload"]["refused"]["count"]) for turn in rounds])),
        ("broken or timed out", cell([float(unanswered(turn["overload"])) for turn in rounds])),
    ]
    return f"`{PROFILE}`, {TIMES} times the capacity, {len(rounds)} rounds:\n\n" + table(("", "median (range)"), rows)


def cell(values: list[float]) -> str:
    """A median with its range."""
    return spread_cell(spread(values).as_json())


def unanswered(result: dict) -> int:
    """Requests without a response."""
    return result["broken"] + result["timed_out"]


def draw(_raw: dict) -> str:
    """No chart: the table shows everything."""
    return ""
