"""SIGTERM under load: every request on an accepted connection gets an answer.

A request is lost if its client had a connection and got no complete answer. Clients behave like a load balancer that
detects only refused connections: these alone are retried elsewhere, any other failure counts. Half of the clients
open a connection for each request, half keep theirs. Half of each send slowly, so that bodies are always in flight
when the signal comes.
"""

import random
import signal
import statistics
import subprocess
import time

from harness.processes import Server
from support.effort import Effort
from support.exchange import Lost, ask, request
from support.lookdown import DETECT, TINY, lookdown
from support.places import OFFICE
from support.rounds import Client, Tally
from support.row import Row

CLIENTS = 12
REQUEST_SECONDS = 5
GRACE_SECONDS = 1
BOUND_SECONDS = GRACE_SECONDS + REQUEST_SECONDS + 1.0
SETTINGS = TINY | {
    "LOG__FILTER": "error",
    "SERVER__REQUEST_TIMEOUT_MILLIS": str(REQUEST_SECONDS * 1000),
    "SHUTDOWN__GRACE_MILLIS": str(GRACE_SECONDS * 1000),
}
NOTICE_SECONDS = 0.5
"""Time within which `/readyz` announces the shutdown."""
WELCOME = {200, 429, 503}
"""Permitted answers. 429 and 503 are refusals."""


def prove(effort: Effort) -> list[Row]:
    """Stops `effort.stops` servers."""
    row = Row(
        "SIGTERM under load", f"{effort.stops} times, {CLIENTS} clients that never pause, {GRACE_SECONDS} s of grace"
    )
    tally, seconds, codes, notices = Tally(), [], [], []
    for _ in range(effort.stops):
        with lookdown(SETTINGS) as server:
            clients = start_clients(server, tally)
            time.sleep(random.uniform(0.2, 0.6))
            began = time.monotonic()
            server.process.send_signal(signal.SIGTERM)
            notices.append(seconds_to_notice(server))
            codes.append(exit_status(server))
            seconds.append(time.monotonic() - began)
        for client in clients:
            client.join()
    answers, lost = dict(sorted(tally.statuses.items())), tally.lost
    row.seen = (
        f"{tally.asked()} requests, answered {answers}, {len(lost)} lost; `/readyz` 503 within "
        f"{1000 * max(notices):.0f} ms; gone after {statistics.median(seconds):.2f} s (at most {max(seconds):.2f})"
    )
    others = set(answers) - WELCOME
    row.require(not lost, f"lost: {sorted(set(lost))} ({len(lost)} of {tally.asked()})")
    row.require(not others, f"unexpected statuses: {others}")
    row.require(set(codes) == {0}, f"exit statuses {sorted(map(str, set(codes)))}")
    row.require(max(notices) <= NOTICE_SECONDS, f"/readyz was not 503 for {max(notices):.2f} s")
    row.require(max(seconds) <= BOUND_SECONDS, f"took {max(seconds):.1f} s; the bound is {BOUND_SECONDS:.0f} s")
    return [row]


def start_clients(server: Server, tally: Tally) -> list[Client]:
    """Starts the same number of clients of every kind."""
    frame = OFFICE.read_bytes()
    headers = {"Content-Type": "image/jpeg"}
    kept = request("POST", DETECT, frame, headers)
    alone = request("POST", DETECT, frame, headers | {"Connection": "close"})
    clients = []
    for index in range(CLIENTS):
        keeps = index % 2 == 0
        sent = kept if keeps else alone
        clients.append(Client(server.address, lambda sent=sent: sent, tally, keeps=keeps, slowly=index % 4 < 2))
    for client in clients:
        client.start()
    return clients


def seconds_to_notice(server: Server) -> float:
    """The time until `/readyz` answers 503."""
    began = time.monotonic()
    while time.monotonic() - began <= NOTICE_SECONDS:
        try:
            if ask(server.address, "GET", "/readyz").status == 503:
                return time.monotonic() - began
        except (Lost, OSError):
            break
    return float("inf")


def exit_status(server: Server) -> int | None:
    """The exit status of the server. `None` if it had to be killed."""
    try:
        return server.process.wait(timeout=2 * BOUND_SECONDS)
    except subprocess.TimeoutExpired:
        server.process.kill()
        server.process.wait()
        return None
