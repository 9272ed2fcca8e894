"""Clients that block `lookdown count` and `lookdown watch`: silent and slow connections, and answers that are not
read."""

import contextlib
import socket
import sqlite3
import subprocess
import tempfile
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

from harness.processes import Server
from support.companion import count, watch
from support.effort import Effort
from support.exchange import Lost, ask, connect, request
from support.row import Row

LOCAL = {"Host": "localhost"}
SILENT = 48
"""Fewer than the connections of a companion."""
READERS = 40
NOWHERE = "127.0.0.1:9"
"""No server: the companions serve requests all the same."""
LONGEST_SECONDS = 1.0
"""Longest time of an answer beside the hostile connections."""
MAX_GROWTH_MIB = 200
STEPS = 1000
NAMES = 32
MEBIBYTE = 1 << 20


def prove(_: Effort) -> list[Row]:
    """Returns a row for each kind of client."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with count(NOWHERE, folder / "counts.sqlite") as counts:
            rows = [_blocked("count", counts)]
        with watch(NOWHERE, folder) as watched:
            rows.append(_blocked("watch", watched))
        _fill(folder / "counts.sqlite")
        with count(NOWHERE, folder / "counts.sqlite") as counts:
            return [*rows, _unread(counts)]


def _seconds(row: Row, address: str, path: str) -> float:
    began = time.monotonic()
    try:
        status = ask(address, "GET", path, headers=LOCAL, timeout=LONGEST_SECONDS * 5).status
    except (Lost, OSError) as error:
        status = f"nothing ({error})"
    row.require(status == 200, f"{path} was answered {status}")
    return time.monotonic() - began


def _blocked(name: str, server: Server) -> Row:
    row = Row(f"blocked {name}", f"{SILENT} silent connections, and as many with heads that do not end")
    slowest = 0.0
    for sent in (b"", b"GET / HTTP/1.1\r\nX: "):
        with contextlib.ExitStack() as stack:
            for _ in range(SILENT):
                opened = stack.enter_context(contextlib.closing(connect(server.address)))
                # The server may close connections beyond its limit.
                with contextlib.suppress(OSError):
                    opened.sendall(sent)
            slowest = max([slowest, *(_seconds(row, server.address, "/livez") for _ in range(3))])
    row.seen = f"/livez is answered within {slowest * 1000:.0f} ms"
    row.require(slowest < LONGEST_SECONDS, "it is answered late")
    return row


def _fill(store: Path) -> None:
    """Writes counts of a camera with many lines and zones."""
    last = int(time.time() // 60)
    with contextlib.closing(sqlite3.connect(store)) as database, database:
        minutes = [("camera:hall", minute, 60000, 100, 3) for minute in range(last - STEPS, last)]
        database.executemany("insert into presence values (?, ?, ?, ?, ?)", minutes)
        zones = [("hall", f"zone-with-a-long-name-{name}", last - 7, 1, 1, 1, 1, 1) for name in range(NAMES)]
        database.executemany("insert into zones values (?, ?, ?, ?, ?, ?, ?, ?)", zones)


def _unread(server: Server) -> Row:
    row = Row(
        "unread counts", f"{READERS} clients request {STEPS} steps of {NAMES} zones, 20 times each, and read none"
    )
    begin = datetime.now(UTC) - timedelta(minutes=STEPS - 10)
    path = f"/counts/hall?step=1m&from={begin.strftime('%Y-%m-%dT%H:%M:00Z')}"
    one = ask(server.address, "GET", path, headers=LOCAL)
    row.require(one.status == 200, f"a request was answered {one.status}: {one.body[:200]!r}")
    endless = f"{path}&to=9999-01-01T00:00:00Z"
    too_many = ask(server.address, "GET", endless, headers=LOCAL)
    row.require(too_many.status == 422, f"too many steps were answered {too_many.status}")
    before, slowest = _resident(server.process), 0.0
    with contextlib.ExitStack() as stack:
        for _ in range(READERS):
            opened = stack.enter_context(contextlib.closing(connect(server.address)))
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            with contextlib.suppress(OSError):
                opened.sendall(request("GET", path, headers=LOCAL) * 20)
        for _ in range(10):
            slowest = max(slowest, _seconds(row, server.address, "/livez"))
            time.sleep(0.3)
        grown = _resident(server.process) - before
    row.seen = f"{len(one.body) / MEBIBYTE:.1f} MiB each; {grown} MiB more; /livez within {slowest * 1000:.0f} ms"
    row.require(grown <= MAX_GROWTH_MIB, f"memory grows by {grown} MiB")
    row.require(slowest < LONGEST_SECONDS, "/livez is answered late")
    return row


def _resident(process: subprocess.Popen) -> int:
    for line in Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) // 1024
    return 0
