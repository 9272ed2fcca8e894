"""Starts `lookdown count` and `lookdown watch` for the proofs."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from harness.places import LOOKDOWN
from harness.processes import Server, free_ports, running

from .exchange import ask

LIBRARY = "libfaketimeMT.so.1"
FOLDERS = ("/usr/lib", "/usr/lib64", "/usr/local/lib")
NO_LIBRARY = "needs libfaketime (Debian: apt-get install libfaketime)"


def faketime() -> Path | None:
    """The library that replaces the clock of a process, if it is installed."""
    return next((found for folder in FOLDERS for found in sorted(Path(folder).rglob(LIBRARY))), None)


def clock_of(library: Path, clock: Path) -> dict[str, str]:
    """The environment of a process whose clock is in a file. The monotonic clock is not changed, as when a real clock
    is set."""
    return {
        "LD_PRELOAD": str(library),
        "FAKETIME_TIMESTAMP_FILE": str(clock),
        "FAKETIME_NO_CACHE": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
    }


@contextlib.contextmanager
def count(server: str, store: Path, environment: dict[str, str] | None = None) -> Iterator[Server]:
    """Counts the reports of a server."""
    (port,) = free_ports(1)
    arguments = ["--server", f"http://{server}", "--listen", f"127.0.0.1:{port}", "--store", str(store)]
    command = [str(LOOKDOWN), "count", *arguments]
    with running("count", command, port, "/livez", environment or {}) as started:
        yield started


@contextlib.contextmanager
def watch(server: str, camera: Path) -> Iterator[Server]:
    """Sends the files of a folder to a server, with metrics."""
    (port,) = free_ports(1)
    arguments = [str(camera), "--name", "hall", "--server", f"http://{server}", "--metrics-listen", f"127.0.0.1:{port}"]
    with running("watch", [str(LOOKDOWN), "watch", *arguments], port, "/metrics", dict(os.environ)) as started:
        yield started


def metric(address: str, name: str) -> float:
    """The sum of a metric over its labels; 0 if there is none."""
    lines = ask(address, "GET", "/metrics", headers={"Host": "localhost"}).body.decode().splitlines()
    named = [line for line in lines if line.startswith((f"{name} ", f"{name}{{"))]
    return sum(float(line.rpartition(" ")[2]) for line in named)
