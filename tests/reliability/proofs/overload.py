"""Ten times the load that can be served: goodput stays, other requests are refused quickly, none is cut off."""

from harness.load import load
from support.effort import Effort
from support.holdings import Watch
from support.lookdown import DETECT, lookdown
from support.places import OFFICE
from support.row import Row

TIMES = 10
CLIENTS = 8
LEAST_GOODPUT = 0.7
"""Fraction of the capacity. The load generator and the refusals use the same cores."""
MOST_REFUSAL_MILLIS = 250.0
MOST_GROWTH_MIB = 256.0
"""The limit of request bodies, `limits.max_upload_bytes`."""


def prove(effort: Effort) -> list[Row]:
    """Runs with the default settings and a real model."""
    row = Row("overload", f"{TIMES} times the capacity for {effort.overload_seconds:.0f} s, profile `fast`, open loop")
    with lookdown({"LOG__FILTER": "error"}) as server:
        with Watch(server.pid, 0.1) as calm_memory:
            calm = load(server, [DETECT], OFFICE, clients=CLIENTS, seconds=effort.overload_seconds / 2)
        capacity = calm["succeeded_per_second"]
        with Watch(server.pid, 0.1) as storm_memory:
            storm = load(server, [DETECT], OFFICE, rate=TIMES * capacity, seconds=effort.overload_seconds)
    goodput = storm["succeeded_per_second"] / capacity
    refusal = storm["refused"].get("p99_ms", 0.0)
    growth = storm_memory.peak_resident_mib() - calm_memory.peak_resident_mib()
    cut_off = storm["broken"] + storm["timed_out"]
    others = set(storm["statuses"]) - {"200", "429"}
    row.seen = (
        f"capacity {capacity:.0f} frames/s, goodput {goodput:.2f} of it; {storm['refused']['count']} refused, p99 "
        f"{refusal:.0f} ms; {cut_off} cut off; memory {growth:+.0f} MiB at its peak"
    )
    row.require(goodput >= LEAST_GOODPUT, f"goodput is {goodput:.2f} of the capacity")
    row.require(refusal <= MOST_REFUSAL_MILLIS, f"refusals take {refusal:.0f} ms")
    row.require(not cut_off, f"{cut_off} were cut off")
    row.require(not others, f"unexpected statuses: {others}")
    row.require(growth <= MOST_GROWTH_MIB, f"memory grew by {growth:.0f} MiB")
    return [row]
