"""Waits for a state instead of a fixed time, and reads the metrics of a server."""

import time
from collections.abc import Callable

from harness.processes import Server

PATIENCE_SECONDS = 15.0
LOOKS_PER_SECOND = 50.0


def wait_until(holds: Callable[[], object], what: str, seconds: float = PATIENCE_SECONDS) -> object:
    """Waits until `holds` returns a true value and returns it. Otherwise an `AssertionError` names `what`."""
    deadline = time.monotonic() + seconds
    while not (found := holds()):
        if time.monotonic() > deadline:
            raise AssertionError(f"waited {seconds:.0f} s in vain until {what}")
        time.sleep(1.0 / LOOKS_PER_SECOND)
    return found


def metric(server: Server, series: str) -> float:
    """The value of a series of Lookdown, `name` or `name{label="value"}`, without the common prefix."""
    lines = server.get("/metrics").decode().splitlines()
    return float(next(line.rsplit(" ", 1)[1] for line in lines if line.startswith(f"lookdown_{series} ")))
