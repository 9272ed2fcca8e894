"""Loads a server with the load generator."""

import json
import subprocess
import time
from pathlib import Path

from .places import LOAD
from .processes import BenchError, Server

OPEN_LOOP_CLIENTS = 256
"""The maximum number of simultaneous requests in an open loop."""


def load(
    server: Server,
    paths: list[str],
    body: Path,
    *,
    seconds: float,
    clients: int = 1,
    rate: float | None = None,
    warm_up: float = 1.0,
    content_type: str = "image/jpeg",
) -> dict:
    """Closed loop with `clients`, or open loop with `rate` requests per second.

    What the load generator tells, and the server's `cores` (CPU seconds per second), `cpu_seconds_per_frame` and
    `resident_mib` at the end.
    """
    before, began = server.usage(), time.monotonic()
    at_once = clients if rate is None else OPEN_LOOP_CLIENTS
    command = _command(server, paths, body, seconds, at_once, rate, warm_up, content_type)
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    after, wall = server.usage(), time.monotonic() - began
    if answer.returncode != 0:
        raise BenchError(f"the load generator failed: {answer.stderr.strip()}")
    result = json.loads(answer.stdout)
    cpu = after.cpu_seconds - before.cpu_seconds
    return result | {
        "clients": clients,
        "rate": rate,
        "cores": cpu / wall,
        "cpu_seconds_per_frame": cpu / max(result["succeeded_in_all"], 1),
        "resident_mib": after.resident_bytes / 2**20,
    }


def steady(
    server: Server,
    paths: list[str],
    body: Path,
    *,
    clients: int,
    seconds: float,
    frame_seconds: float,
    content_type: str = "image/jpeg",
) -> dict:
    """A closed loop whose warm-up and window are long enough for every client, if a frame takes `frame_seconds`."""
    turn = clients * frame_seconds
    warm_up, seconds = max(1.0, 1.2 * turn), max(seconds, 2.0 * turn)
    result = load(server, paths, body, clients=clients, warm_up=warm_up, seconds=seconds, content_type=content_type)
    if not result["succeeded"]["count"]:
        raise BenchError(f"{paths[0]}: no successful response in {seconds:.0f} s: {result}")
    return result


def start_load(
    server: Server, paths: list[str], body: Path, *, seconds: float, rate: float, clients: int = OPEN_LOOP_CLIENTS
) -> subprocess.Popen:
    """An open loop in the background, with up to `clients` requests at a time, each on a connection that is kept."""
    command = _command(server, paths, body, seconds, clients, rate, 1.0, "image/jpeg")
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def _command(server, paths, body, seconds, clients, rate, warm_up, content_type) -> list[str]:
    loop = ["--clients", clients, *([] if rate is None else ["--rate", rate])]
    turns = [word for path in paths for word in ("--path", path)]
    times = ["--seconds", seconds, "--warm-up-seconds", warm_up]
    command = [LOAD, server.address, *turns, "--body", body, "--content-type", content_type, *loop, *times]
    return [str(word) for word in command]
