"""A long steady load of valid and invalid input: memory, threads and descriptors do not grow."""

import json
import statistics
import tempfile
from pathlib import Path

from harness.load import load, start_load
from support.effort import Effort
from support.holdings import Holdings, Watch, growth
from support.lookdown import DETECT, lookdown
from support.places import OFFICE
from support.row import Row

LOAD = 0.8
"""Fraction of the capacity."""
BAD_PER_SECOND = 4.0
"""Requests of each kind of bad input."""
CLIENTS = 64
"""Clients of each stream. They alternate and keep their connections: in total fewer than `server.max_connections`."""
WARM_UP = 0.25
"""Fraction of the time that is not counted: caches fill, and the allocator reaches its size."""
MOST_GROWTH = 0.05
"""Growth of memory over the counted time."""
MOST_MORE = 3.0
"""Growth of threads and descriptors over the same time: connections open and close."""


def prove(effort: Effort) -> list[Row]:
    """Runs with the default settings and a real model."""
    minutes = effort.soak_seconds / 60
    row = Row("soak", f"{minutes:.1f} min at {LOAD:.0%} of the capacity, profile `fast`, and four kinds of bad input")
    frame = OFFICE.read_bytes()
    with tempfile.TemporaryDirectory() as name, lookdown({"LOG__FILTER": "error"}) as server:
        folder = Path(name)
        capacity = load(server, [DETECT], OFFICE, clients=4, seconds=3.0)["succeeded_per_second"]
        streams = [
            ("200", DETECT, frame, LOAD * capacity),
            ("415", DETECT, b"no image at all", BAD_PER_SECOND),
            ("422", DETECT, frame[: len(frame) // 2], BAD_PER_SECOND),
            ("422", "/detect?score_threshold=2", frame, BAD_PER_SECOND),
            ("404", "/detect?calibration=unknown", frame, BAD_PER_SECOND),
        ]
        with Watch(server.pid, effort.soak_seconds / 200) as watch:
            statuses = [
                _ended(status, running)
                for status, running in [
                    _start(server, folder / str(index), stream, effort.soak_seconds)
                    for index, stream in enumerate(streams)
                ]
            ]
    answered = sum(sum(told["statuses"].values()) for _, told in statuses)
    # Under random arrivals a queue may be full for a moment.
    unexpected = [(status, told["statuses"]) for status, told in statuses if set(told["statuses"]) - {status, "429"}]
    cut_off = sum(told["broken"] + told["timed_out"] for _, told in statuses)
    grown, mean = (
        _grown(watch.samples, effort.soak_seconds),
        statistics.mean(seen.resident_mib for _, seen in watch.samples),
    )
    row.seen = (
        f"{answered} answers; memory {mean:.0f} MiB, {grown.resident_mib:+.1f}; threads {grown.threads:+.1f}; "
        f"descriptors {grown.descriptors:+.1f}; {cut_off} cut off"
    )
    row.require(not unexpected, f"unexpected statuses: {unexpected}")
    row.require(not cut_off, f"{cut_off} were cut off")
    row.require(grown.resident_mib <= MOST_GROWTH * mean, f"memory grew by {grown.resident_mib:.1f} of {mean:.0f} MiB")
    row.require(grown.threads <= MOST_MORE, f"threads grew by {grown.threads:.1f}")
    row.require(grown.descriptors <= MOST_MORE, f"descriptors grew by {grown.descriptors:.1f}")
    return [row]


def _start(server, body: Path, stream: tuple, seconds: float) -> tuple:
    status, path, content, rate = stream
    body.write_bytes(content)
    return status, start_load(server, [path], body, seconds=seconds, rate=rate, clients=CLIENTS)


def _ended(status: str, running) -> tuple[str, dict]:
    told, _ = running.communicate()
    return status, json.loads(told)


def _grown(samples: list[tuple[float, Holdings]], seconds: float) -> Holdings:
    """The growth of a regression line through the samples, between warm-up and the end of the load."""
    counted = [(at, seen) for at, seen in samples if WARM_UP * seconds <= at <= seconds]
    fields = ("resident_mib", "threads", "descriptors")
    return Holdings(*(growth([(at, getattr(seen, field)) for at, seen in counted]) for field in fields))
