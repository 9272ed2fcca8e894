"""The cost of dashboards: many clients that poll a camera each second with its ETag, and many event streams."""

import asyncio
import contextlib
import shutil
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from harness.effort import Effort
from harness.figures import ratios, spread, spread_cell, table
from harness.frames import frame
from harness.lookdown import detect, lookdown, report
from harness.processes import BenchError, Server, free_ports, running

POLLERS = 200
LISTENERS = 1000
PATH = "/results/office/latest"
EVENTS = "/results/office/events"
SETTINGS = {"SERVER__MAX_CONNECTIONS": "2000", "RESULTS__MAX_LISTENERS": "1500", "SHUTDOWN__GRACE_MILLIS": "0"}
REPORTS = 40
"""The duration with event streams; memory is measured after the first quarter and at the end."""
# HAProxy with fixed responses, on one thread: a lower bound of the cost of a response.
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


@dataclass
class Heard:
    """The events that all clients together have received."""

    reports: int = 0
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    async def wait_for(self, reports: int) -> None:
        """Waits until the clients have received `count` events."""
        while self.reports < reports:
            self.changed.clear()
            await self.changed.wait()


def measure(effort: Effort) -> dict:
    """The cost of polls without new reports, alternating with a server of fixed responses; then
    event streams and new reports."""
    # The kernel counts CPU time in hundredths of a second, and the measurement takes a fifth of one.
    seconds = max(2 * effort.seconds, 10.0)
    ours, least = [], []
    with lookdown(SETTINGS) as server, haproxy() as other:
        report(server, detect("fast"), frame())
        tag = server_tag(server)
        for _ in range(effort.rounds):
            ours.append(asyncio.run(poll(server, tag, seconds)))
            least.append(asyncio.run(poll(other, tag, seconds)))
        listening = asyncio.run(listen(server))
    return {
        "statuses": ours[-1]["statuses"],
        "percent": [turn["percent"] for turn in ours],
        "least_percent": [turn["percent"] for turn in least],
        "listening": listening,
    }


def server_tag(server: Server) -> str:
    """The entity tag of the latest report."""
    with urllib.request.urlopen(f"http://{server.address}{PATH}", timeout=10) as answer:
        return answer.headers["ETag"]


async def poll(server: Server, tag: str, seconds: float) -> dict:
    """The responses to the pollers, and the share of a core that they took. A dashboard keeps its connection, so
    the measurement begins when each client has a connection and its first response."""
    request = f"GET {PATH} HTTP/1.1\r\nHost: localhost\r\nIf-None-Match: {tag}\r\n\r\n".encode()
    statuses: dict[str, int] = {}
    dashboards = [await connect(server.address) for _ in range(POLLERS)]

    async def ask(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> str:
        writer.write(request)
        return (await reader.readuntil(b"\r\n\r\n"))[9:12].decode()

    for dashboard in dashboards:
        await ask(*dashboard)
    before, began = server.usage().cpu_seconds, time.monotonic()

    async def keep_asking(dashboard: tuple[asyncio.StreamReader, asyncio.StreamWriter], phase: float) -> None:
        await asyncio.sleep(phase)
        while time.monotonic() < began + seconds:
            status = await ask(*dashboard)
            statuses[status] = statuses.get(status, 0) + 1
            await asyncio.sleep(1.0)

    await asyncio.gather(*(keep_asking(each, number / POLLERS) for number, each in enumerate(dashboards)))
    cores = (server.usage().cpu_seconds - before) / (time.monotonic() - began)
    for _, writer in dashboards:
        writer.close()
    return {"statuses": statuses, "percent": 100 * cores}


async def listen(server: Server) -> dict:
    """Memory with all event streams open; checks that each receives each report."""
    heard, idle = Heard(), server.usage().resident_bytes

    async def one() -> None:
        reader, writer = await connect(server.address)
        writer.write(f"GET {EVENTS} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        try:
            while line := await reader.readline():
                heard.reports += line.startswith(b"id:")
                heard.changed.set()
        finally:
            writer.close()

    listeners = [asyncio.create_task(one()) for _ in range(LISTENERS)]
    # Each stream begins with the latest report.
    await heard.wait_for(LISTENERS)
    connected = server.usage().resident_bytes
    resident = []
    for number in range(1, REPORTS + 1):
        await asyncio.to_thread(report, server, detect("fast"), frame())
        await heard.wait_for(LISTENERS * (number + 1))
        resident.append(server.usage().resident_bytes)
    for listener in listeners:
        listener.cancel()
    await asyncio.gather(*listeners, return_exceptions=True)
    early = resident[len(resident) // 4]
    return {
        "heard": heard.reports,
        "kib_each": (connected - idle) / LISTENERS / 1024,
        "mib": connected / 2**20,
        "mib_more": (resident[-1] - early) / 2**20,
    }


async def connect(address: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A connection to the server."""
    host, _, port = address.rpartition(":")
    return await asyncio.open_connection(host, int(port))


def tell(raw: dict) -> str:
    """Both as Markdown."""
    listening = raw["listening"]
    answers = ", ".join(f"{count} × {status}" for status, count in sorted(raw["statuses"].items()))
    rows = [
        (f"{POLLERS} pollers, one poll a second each with its ETag: answers", answers),
        ("**share of a core**, %", spread_cell(spread(raw["percent"]))),
        ("HAProxy's for as many fixed responses, alternating, %", spread_cell(spread(raw["least_percent"]))),
        ("ours ÷ HAProxy's", spread_cell(ratios(raw["percent"], raw["least_percent"]))),
        (f"{LISTENERS} event streams: reports received of {LISTENERS * (REPORTS + 1)}", listening["heard"]),
        ("memory for each, KiB", listening["kib_each"]),
        ("memory with all of them, MiB", listening["mib"]),
        (f"… and after {REPORTS - REPORTS // 4} more reports, MiB", listening["mib_more"]),
    ]
    return table(("", ""), rows)
