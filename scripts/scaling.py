"""Simulates the number of replicas for cameras: `scaling.py FIGURES.json CORES [PROFILE...]` prints Markdown.

FIGURES.json has the measurements of one replica (docs/lab/scaling.json). A replica of CORES cores is modeled as a queue
that processes one frame after the other with all cores, as Lookdown does with the views of a frame. So a frame takes
its CPU time divided by the cores. Cameras send at their own phase, with a small jitter. The load balancer sends each
frame to a random replica, in turns, or to the replica that finishes first.
"""

import heapq
import itertools
import json
import math
import random
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

CAMERAS = (10, 100, 1000, 10_000)
FRAMES_PER_SECOND = 1.0
JITTER_SECONDS = 0.05
"""The maximum jitter of a frame."""
SECONDS, WARM_UP_SECONDS = 60.0, 20.0
TARGET_SECONDS = 1.0
"""The limit of the 99th percentile of the latency."""
MOST_BUSY = 0.8
"""The maximum planned load of the cores; the rest is for the failure of a replica."""
SEED = 7


def arrivals(cameras: int, chance: random.Random) -> list[float]:
    """The sorted arrival times of frames, seconds."""
    period = 1.0 / FRAMES_PER_SECOND
    phases = [chance.uniform(0.0, period) for _ in range(cameras)]
    times = [
        phase + turn * period + chance.uniform(-JITTER_SECONDS, JITTER_SECONDS)
        for phase in phases
        for turn in range(round(SECONDS * FRAMES_PER_SECOND))
    ]
    return sorted(times)


def latencies(
    times: Iterable[float], service: float, replicas: int, balancer: str, chance: random.Random
) -> list[float]:
    """The latencies of frames in seconds, without the warm-up."""
    seen = []
    for at, done in _answers(times, service, replicas, balancer, chance):
        if at >= WARM_UP_SECONDS:
            seen.append(done - at)
    return seen


def _answers(
    times: Iterable[float], service: float, replicas: int, balancer: str, chance: random.Random
) -> Iterator[tuple[float, float]]:
    if balancer == "first done":
        free = [0.0] * replicas
        for at in times:
            done = max(at, free[0]) + service
            heapq.heapreplace(free, done)
            yield at, done
        return
    turns = itertools.count()
    free = [0.0] * replicas
    for at in times:
        chosen = chance.randrange(replicas) if balancer == "random" else next(turns) % replicas
        free[chosen] = max(at, free[chosen]) + service
        yield at, free[chosen]


BALANCERS = ("random", "in turns", "first done")


def needed(cameras: int, service: float, balancer: str) -> int:
    """The minimum number of replicas that meets the target, with `seconds` of work per frame."""
    if service > TARGET_SECONDS:
        raise ValueError(f"a frame alone takes {service:.2f} s, more than {TARGET_SECONDS:.2f} s: give more cores")
    times = arrivals(cameras, random.Random(SEED))
    replicas = max(1, math.ceil(cameras * FRAMES_PER_SECOND * service / MOST_BUSY))
    # In steps of 1 %: single replicas do not matter among thousands.
    while True:
        slowest = percentile(latencies(times, service, replicas, balancer, random.Random(SEED)), 0.99)
        if slowest <= TARGET_SECONDS:
            return replicas
        replicas += max(1, replicas // 100)


def percentile(values: list[float], share: float) -> float:
    """The quantile of values."""
    return sorted(values)[math.ceil(share * len(values)) - 1]


def table(figures: dict, cores: int, profile: str) -> str:
    """A table with a row for each number of cameras."""
    core_seconds = figures["profiles"][profile]["core_ms_per_frame"] / 1000
    views, redis_ms = figures["profiles"][profile]["views"], figures["redis"]["core_ms_per_report"]
    lines = [
        "| cameras | views/s | busy cores | replicas: " + " | ".join(BALANCERS) + " | frames in, Mbit/s |"
        " cores of Redis | cores per camera |",
        "|" + "---:|" * (6 + len(BALANCERS)),
    ]
    for cameras in CAMERAS:
        frames = cameras * FRAMES_PER_SECOND
        counts = [needed(cameras, core_seconds / cores, balancer) for balancer in BALANCERS]
        cells = [
            f"{cameras:,}",
            f"{frames * views:,.0f}",
            f"{frames * core_seconds:,.1f}",
            *(f"{count:,}" for count in counts),
            f"{frames * figures['frame_bytes'] * 8 / 1e6:,.0f}",
            f"{frames * redis_ms / 1000:,.2f}",
            f"{counts[-1] * cores / cameras:.2f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main(arguments: list[str]) -> int:
    """The exit status."""
    if len(arguments) < 2 or not arguments[1].isdecimal():
        print("usage: scaling.py FIGURES.json CORES [PROFILE...]", file=sys.stderr)
        return 2
    file, cores, *profiles = arguments
    figures = json.loads(Path(file).read_text(encoding="utf-8"))
    for profile in profiles or figures["profiles"]:
        print(f"`{profile}`, replicas of {cores} cores:\n\n{table(figures, int(cores), profile)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
