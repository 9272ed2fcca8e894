"""The growth of the cost with views, frame size and clients."""

from harness.charts import lines
from harness.effort import Effort
from harness.frames import frame
from harness.load import steady
from harness.lookdown import MODEL, ROOMY, detect, lookdown, report, view_plan
from harness.tables import table

from .whole import stages_of

PLANS = ("direct", "fast", "balanced", "paper")
CLIENT_PROFILE = "fast"


def measure(effort: Effort) -> dict:
    """Varies one parameter at a time, with one model."""
    with lookdown(ROOMY) as server:
        views = [with_views(effort, server, profile) for profile in PLANS]
        sides = [with_side(effort, server, side) for side in effort.sides]
        path = detect(CLIENT_PROFILE, model=MODEL)
        alone = stages_of(server, path, effort.frames)["total"] / 1000
        clients = [
            steady(server, [path], frame(), clients=count, seconds=effort.seconds / 2, frame_seconds=alone)
            for count in effort.many_clients
        ]
    return {
        "views": views,
        "sides": sides,
        "clients": clients,
    }


def with_views(effort: Effort, server, profile: str) -> dict:
    """The stages of a frame with a plan."""
    count = max(len(view_plan(server, profile)["views"]), 1)
    stages = stages_of(server, detect(profile, model=MODEL), effort.frames)
    return {"profile": profile, "views": count, "stages": stages}


def with_side(effort: Effort, server, side: int) -> dict:
    """The stages of frames of a size."""
    path, jpeg = detect("balanced", model=MODEL), frame(side)
    report(server, path, jpeg)
    timings = [report(server, path, jpeg)["timings_ms"] for _ in range(effort.frames)]
    middle = len(timings) // 2
    stages = {stage: sorted(timing[stage] for timing in timings)[middle] for stage in timings[0]}
    return {"side": side, "kilobytes": jpeg.stat().st_size / 1000, "stages": stages}


def tell(raw: dict) -> str:
    """The three tables as Markdown."""
    return "\n".join(
        [
            f"With views (one client, {MODEL}, ms):\n",
            table(
                ("profile", "views", "total", "remap per view", "network per view"),
                [views_row(row) for row in raw["views"]],
            ),
            "With the frame (one client, `balanced`, ms):\n",
            table(
                ("side, pixels", "JPEG, kB", "decode", "remap", "inference", "total"),
                [sides_row(row) for row in raw["sides"]],
            ),
            f"With clients (closed loop, `{CLIENT_PROFILE}`):\n",
            table(
                ("clients", "frames/s", "p50, ms", "p99, ms", "cores used", "memory, MiB"),
                [clients_row(result) for result in raw["clients"]],
            ),
        ]
    )


def views_row(row: dict) -> tuple:
    """One plan."""
    stages, views = row["stages"], row["views"]
    return row["profile"], views, stages["total"], stages["remap"] / views, stages["inference"] / views


def sides_row(row: dict) -> tuple:
    """One size of frame."""
    return row["side"], row["kilobytes"], *(row["stages"][name] for name in ("decode", "remap", "inference", "total"))


def clients_row(result: dict) -> tuple:
    """One number of clients."""
    late = result["succeeded"]
    times = (late.get("p50_ms"), late.get("p99_ms"))
    return result["clients"], result["succeeded_per_second"], *times, result["cores"], round(result["resident_mib"])


def draw(raw: dict) -> str:
    """Time with views, and with the frame, as charts."""
    per_views = [(row["views"], row["stages"]["total"]) for row in raw["views"]]
    per_side = [
        (name, [(row["side"], row["stages"][name]) for row in raw["sides"]]) for name in ("decode", "remap", "total")
    ]
    return lines("growth-views", f"A frame's time with views, {MODEL}", ("views", "ms"), {"total": per_views}) + lines(
        "growth-frame", "A frame's time with its size, balanced", ("side, pixels", "ms"), dict(per_side)
    )
