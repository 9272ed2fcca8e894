"""HAProxy with fixed responses to polls, on one thread: a lower bound of the cost of a response."""

import contextlib
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .processes import BenchError, Server, free_ports, running

# Its rules cannot return 304. This response has fewer headers than Lookdown's, and no body either.
PLAN = """
global
    nbthread 1
defaults
    mode http
    timeout connect 1s
    timeout client 60s
    timeout server 60s
frontend polls
    bind 127.0.0.1:{port}
    http-request return status 200 hdr ETag "\\"0\\"" hdr Cache-Control no-cache hdr X-Request-Id "%[uuid]"
"""


@contextlib.contextmanager
def haproxy() -> Iterator[Server]:
    """Starts HAProxy and waits until it responds."""
    if shutil.which("haproxy") is None:
        raise BenchError("haproxy is missing: apt-get install haproxy")
    (port,) = free_ports(1)
    with tempfile.TemporaryDirectory() as folder:
        plan = Path(folder) / "haproxy.cfg"
        plan.write_text(PLAN.format(port=port), encoding="utf-8")
        with running("haproxy", ["haproxy", "-db", "-f", str(plan)], port, "/", {}) as server:
            yield server
