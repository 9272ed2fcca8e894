"""More clients than the process has file descriptors: it stays idle, and serves again when they have disconnected."""

import time

from harness.usage import usage_of
from support.effort import Effort
from support.exchange import Lost, ask, connect, vanish
from support.lookdown import DETECT, TINY, lookdown
from support.places import OFFICE
from support.row import Row

DESCRIPTORS = 64
CLIENTS = 150
"""Less than the additional backlog of the system."""
WATCHED_SECONDS = 3.0
MOST_CORES = 0.2
"""Most CPU use of a server that cannot accept connections: it must pause between attempts."""
RECOVERY_SECONDS = 5.0


def prove(effort: Effort) -> list[Row]:
    """Runs twice in a row to detect leaks."""
    del effort
    row = Row(
        "descriptors exhausted", f"{CLIENTS} connections to a server that may have {DESCRIPTORS} descriptors, twice"
    )
    inside = ("prlimit", f"--nofile={DESCRIPTORS}:{DESCRIPTORS}")
    with lookdown(TINY | {"LOG__FILTER": "off", "INFERENCE__SESSIONS": "1"}, inside=inside) as server:
        figures = [_exhaust(server, row) for _ in range(2)]
        row.require(server.process.poll() is None, "the server ended")
    row.seen = "; ".join(f"used {cores:.2f} cores, served again after {seconds:.2f} s" for cores, seconds in figures)
    return [row]


def _exhaust(server, row: Row) -> tuple[float, float]:
    connections = [connect(server.address) for _ in range(CLIENTS)]
    before = usage_of(server.pid).cpu_seconds
    time.sleep(WATCHED_SECONDS)
    cores = (usage_of(server.pid).cpu_seconds - before) / WATCHED_SECONDS
    row.require(cores <= MOST_CORES, f"used {cores:.2f} cores while nothing could be accepted")
    for connection in connections:
        vanish(connection)
    began = time.monotonic()
    while time.monotonic() - began < RECOVERY_SECONDS:
        try:
            if ask(server.address, "POST", DETECT, OFFICE.read_bytes(), timeout=RECOVERY_SECONDS).status == 200:
                break
        except (Lost, OSError):
            time.sleep(0.05)
    else:
        row.faults.append(f"served no request for {RECOVERY_SECONDS:.0f} s afterwards")
    return cores, time.monotonic() - began
