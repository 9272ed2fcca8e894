"""SIGTERM under load: nobody whose connection was taken is left without an answer.

A request is lost when its client had a connection and no whole answer came back. Clients behave as behind a load
balancer that only notices a refused connection: that alone sends them elsewhere, any other failure counts. Half of
them open a connection for each request, half keep theirs; half of each send slowly, so that there are always bodies
under way when the signal comes.
"""

import random
import signal
import statistics
import subprocess
import time

from harness.processes import Server
from support.effort import Effort
from support.exchange import request
from support.lookdown import DETECT, TINY, lookdown
from support.places import OFFICE
from support.rounds import Client, Tally
from support.row import Row

CLIENTS = 12
REQUEST_SECONDS = 5
GRACE_SECONDS = 1
BOUND_SECONDS = GRACE_SECONDS + REQUEST_SECONDS + 1.0
SETTINGS = TINY | {"SERVER__REQUEST_TIMEOUT_MILLIS": str(REQUEST_SECONDS * 1000)}
WELCOME = {200, 429, 503}
"""Answers; the latter two are refusals that say so."""


def prove(effort: Effort) -> list[Row]:
    """So many servers are stopped."""
    row = Row("SIGTERM under load", f"{effort.stops} times, {CLIENTS} clients that never pause")
    tally, seconds, codes = Tally(), [], []
    for _ in range(effort.stops):
        with lookdown(SETTINGS) as server:
            clients = start_clients(server, tally)
            time.sleep(random.uniform(0.2, 0.6))
            taken, code = stop(server)
            seconds.append(taken)
            codes.append(code)
        for client in clients:
            client.join()
    others = {status: count for status, count in tally.statuses.items() if status not in WELCOME}
    row.seen = (
        f"{tally.asked()} requests, of them answered {dict(sorted(tally.statuses.items()))}, {len(tally.lost)} lost; "
        f"gone after {statistics.median(seconds):.2f} s (at most {max(seconds):.2f})"
    )
    row.require(not tally.lost, f"lost: {sorted(set(tally.lost))} ({len(tally.lost)} of {tally.asked()})")
    row.require(not others, f"unexpected statuses: {others}")
    row.require(set(codes) == {0}, f"exit statuses {sorted(map(str, set(codes)))}")
    row.require(max(seconds) <= BOUND_SECONDS, f"took {max(seconds):.1f} s; the bound is {BOUND_SECONDS:.0f} s")
    return [row]


def start_clients(server: Server, tally: Tally) -> list[Client]:
    """Of every kind the same number."""
    picture = OFFICE.read_bytes()
    headers = {"Content-Type": "image/jpeg"}
    kept = request("POST", DETECT, picture, headers)
    alone = request("POST", DETECT, picture, headers | {"Connection": "close"})
    clients = []
    for index in range(CLIENTS):
        keeps = index % 2 == 0
        sent = kept if keeps else alone
        clients.append(Client(server.address, lambda sent=sent: sent, tally, keeps=keeps, slowly=index % 4 < 2))
    for client in clients:
        client.start()
    return clients


def stop(server: Server) -> tuple[float, int | None]:
    """Seconds until the server was gone, and its exit status; `None` when it had to be killed."""
    began = time.monotonic()
    server.process.send_signal(signal.SIGTERM)
    try:
        code = server.process.wait(timeout=2 * BOUND_SECONDS)
    except subprocess.TimeoutExpired:
        server.process.kill()
        server.process.wait()
        code = None
    return time.monotonic() - began, code
