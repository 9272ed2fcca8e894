"""The whole service: closed and open loops per profile, and the time per stage."""

from statistics import median

from harness.effort import Effort
from harness.figures import table
from harness.frames import frame
from harness.load import load, steady
from harness.lookdown import ROOMY, detect, lookdown, report
from harness.processes import Server

STAGES = ("decode", "remap", "inference", "refine", "total")


def measure(effort: Effort) -> dict:
    """Starts a server for each profile and kind of loop."""
    return {profile: of_profile(effort, profile) for profile in effort.profiles}


def of_profile(effort: Effort, profile: str) -> dict:
    """Measures stages, closed loops, then open loops at fractions of the closed loops' throughput."""
    paths, jpeg = [detect(profile)], frame()
    with lookdown(ROOMY) as server:
        stages = stages_of(server, paths[0], effort.frames)
        seconds = stages["total"] / 1000
        closed = []
        for clients in effort.clients:
            result = steady(server, paths, jpeg, clients=clients, seconds=effort.seconds, frame_seconds=seconds)
            closed.append(result)
    capacity = max(result["succeeded_per_second"] for result in closed)
    opened = []
    with lookdown() as server:
        report(server, paths[0], jpeg)  # builds the remap tables of the camera
        for percent in effort.loads:
            rate = capacity * percent / 100
            enough = max(effort.seconds, 12 / capacity)
            result = load(server, paths, jpeg, rate=rate, seconds=enough, warm_up=max(1.0, 4 / capacity))
            opened.append(result | {"percent": percent})
    return {"capacity": capacity, "stages": stages, "closed": closed, "open": opened}


def stages_of(server: Server, path: str, frames: int) -> dict[str, float]:
    """Median milliseconds of each stage for consecutive frames with existing remap tables."""
    report(server, path, frame())
    timings = [report(server, path, frame())["timings_ms"] for _ in range(frames)]
    return {stage: median(timing[stage] for timing in timings) for stage in STAGES}


def tell(raw: dict) -> str:
    """The tables as Markdown."""
    return "\n".join(
        [
            "Time per stage of a frame, ms, one client (median):\n",
            table(("profile", *STAGES, "not the network"), [stage_row(name, part) for name, part in raw.items()]),
            "Closed loop:\n",
            table(
                ("profile", "clients", "frames/s", "p50, ms", "p99", "cores used", "memory, MiB"),
                [closed_row(name, result) for name, part in raw.items() for result in part["closed"]],
            ),
            "Open loop, default settings (at most 16 frames in flight), up to 256 requests at a time:\n",
            table(
                ("profile", "load, % of capacity", "frames/s", "p50, ms", "p99")
                + ("refused", "p99 of refusals, ms", "broken or late", "cores used"),
                [open_row(name, result) for name, part in raw.items() for result in part["open"]],
            ),
        ]
    )


def stage_row(profile: str, part: dict) -> tuple:
    """One profile's stages."""
    stages = part["stages"]
    rest = 1 - stages["inference"] / stages["total"]
    return profile, *(stages[stage] for stage in STAGES), f"{rest:.1%}"


def closed_row(profile: str, result: dict) -> tuple:
    """One closed loop."""
    late = result["succeeded"]
    times = (late.get(name) for name in ("p50_ms", "p99_ms"))
    usage = result["cores"], round(result["resident_mib"])
    return profile, result["clients"], result["succeeded_per_second"], *times, *usage


def open_row(profile: str, result: dict) -> tuple:
    """One open loop."""
    late, refused = result["succeeded"], result["refused"]
    times = (late.get(name) for name in ("p50_ms", "p99_ms"))
    unanswered = result["broken"] + result["timed_out"]
    return (
        *(profile, result["percent"], result["succeeded_per_second"], *times),
        *(refused["count"], refused.get("p99_ms"), unanswered, result["cores"]),
    )
