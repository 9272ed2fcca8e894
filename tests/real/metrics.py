"""The metrics of a server."""

from harness.processes import Server


def metric(server: Server, series: str) -> float:
    """The value of a series of Lookdown, `name` or `name{label="value"}`, without the common prefix."""
    lines = server.get("/metrics").decode().splitlines()
    return float(next(line.rsplit(" ", 1)[1] for line in lines if line.startswith(f"lookdown_{series} ")))
