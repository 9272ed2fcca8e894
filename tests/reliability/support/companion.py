"""Starts `lookdown count` and `lookdown watch` for the proofs."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from harness.places import LOOKDOWN
from harness.processes import Server, free_ports, running

from .exchange import ask


@contextlib.contextmanager
def count(server: str, store: Path) -> Iterator[Server]:
    """Counts the reports of a server."""
    (port,) = free_ports(1)
    arguments = ["--server", f"http://{server}", "--listen", f"127.0.0.1:{port}", "--store", str(store)]
    command = [str(LOOKDOWN), "count", *arguments]
    with running("count", command, port, "/livez", {}) as started:
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
