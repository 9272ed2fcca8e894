"""Misbehaving clients, many at a time: they hold resources only for a short time, and other clients are served.

Slow clients send single bytes of the head or of the body, silent ones connect and send nothing, others disconnect
during an upload or while they wait for the answer.
"""

import contextlib
import random
import socket
import threading
import time
from collections.abc import Callable

from harness.processes import Server
from support.effort import Effort
from support.exchange import Lost, ask, connect, read_answer, request, vanish
from support.holdings import holdings
from support.lookdown import DETECT, TINY, lookdown
from support.places import OFFICE
from support.row import Row

REQUEST_SECONDS = 3.0
MILLIS = str(int(REQUEST_SECONDS * 1000))
SETTINGS = TINY | {
    "LOG__FILTER": "error",
    "SERVER__REQUEST_TIMEOUT_MILLIS": MILLIS,
    "SERVER__HEADER_TIMEOUT_MILLIS": MILLIS,
    "SERVER__IDLE_TIMEOUT_MILLIS": MILLIS,
}
PATIENCE_SECONDS = 2 * REQUEST_SECONDS + 4.0
"""After this time no misbehaving client may hold anything."""
LONGEST_SECONDS = PATIENCE_SECONDS + 2.0
"""Time after which a misbehaving client gives up."""
GOOD_SECONDS = 1.0
"""Longest wait of a well-behaved client."""
BYTE_EVERY_SECONDS = 0.4
VISITS = 10
"""Connections of each client that disconnects at once."""


def prove(effort: Effort) -> list[Row]:
    """Returns a row for each kind of client."""
    frame = OFFICE.read_bytes()
    whole = request("POST", DETECT, frame, {"Content-Type": "image/jpeg"})
    head = len(whole) - len(frame)
    kinds = {
        "heads, a byte now and then": lambda link: _drip(link, whole[: head - 4], start=20),
        "bodies, a byte now and then": lambda link: _drip(link, whole[: head + 1000], start=head),
        "silent connections": lambda link: _wait_for_end(link),
        "silence after an answer": lambda link: _silent_after(link),
        "gone in the middle of an upload": lambda link: _send_and_vanish(link, whole[: head + len(frame) // 2]),
        "gone while they wait": lambda link: _send_and_vanish(link, whole),
    }
    with lookdown(SETTINGS) as server:
        ask(server.address, "POST", DETECT, frame)
        return [
            _beside(server, name, client, effort.rude_clients, VISITS if name.startswith("gone") else 1, frame)
            for name, client in kinds.items()
        ]


def _beside(server: Server, name: str, client: Callable, count: int, visits: int, frame: bytes) -> Row:
    row = Row(name, f"{count} at a time{f', {visits} times each' if visits > 1 else ''}, and a good client beside them")
    before, began, held = holdings(server.pid), time.monotonic(), []
    threads = [threading.Thread(target=_be, args=(server.address, client, visits, held)) for _ in range(count)]
    for thread in threads:
        thread.start()
    waits, statuses = [], {}
    while any(thread.is_alive() for thread in threads) and time.monotonic() - began < 2 * LONGEST_SECONDS:
        asked = time.monotonic()
        try:
            status = ask(server.address, "POST", DETECT, frame).status
        except (Lost, OSError) as error:
            status = f"none ({error})"
        waits.append(time.monotonic() - asked)
        statuses[status] = statuses.get(status, 0) + 1
        time.sleep(0.05)
    for thread in threads:
        thread.join()
    time.sleep(0.2)
    after = holdings(server.pid)
    row.seen = (
        f"all gone after {max(held):.1f} s; the good client: {statuses}, slowest {max(waits):.2f} s; descriptors "
        f"{before.descriptors} → {after.descriptors}, {before.resident_mib:.0f} → {after.resident_mib:.0f} MiB"
    )
    row.require(max(held) <= PATIENCE_SECONDS, f"held their places for {max(held):.1f} s")
    # Aborted uploads may use up the limit of frames for a moment, which gives 429.
    row.require(set(statuses) <= {200, 429} and statuses.get(200, 0) > 0, f"the good client was answered {statuses}")
    row.require(max(waits) <= GOOD_SECONDS, f"the good client waited {max(waits):.2f} s")
    row.require(after.descriptors <= before.descriptors + 2, "descriptors were not given back")
    return row


def _be(address: str, client: Callable[[socket.socket], None], visits: int, held: list[float]) -> None:
    """Records the duration of each of the client's connections."""
    for _ in range(visits):
        began = time.monotonic()
        with contextlib.suppress(OSError, Lost), contextlib.closing(connect(address, LONGEST_SECONDS)) as connection:
            client(connection)
        held.append(time.monotonic() - began)
        if visits > 1:
            time.sleep(random.uniform(0.0, 0.4))


def _drip(connection: socket.socket, sent: bytes, *, start: int) -> None:
    """Sends the start at once and the rest byte by byte until the server closes the connection."""
    connection.sendall(sent[:start])
    connection.settimeout(BYTE_EVERY_SECONDS)
    deadline = time.monotonic() + LONGEST_SECONDS
    for byte in sent[start:]:
        connection.sendall(bytes([byte]))
        try:
            if not connection.recv(4096):
                return
        except TimeoutError:
            if time.monotonic() > deadline:
                return


def _wait_for_end(connection: socket.socket) -> None:
    connection.recv(1)


def _silent_after(connection: socket.socket) -> None:
    connection.sendall(request("GET", "/livez"))
    read_answer(connection)
    _wait_for_end(connection)


def _send_and_vanish(connection: socket.socket, sent: bytes) -> None:
    connection.sendall(sent)
    vanish(connection)
