"""One client that offers 20 times its share of frames takes no more than its turns.

Every client has a key and sends frames in a closed loop. Each has one connection, or the greedy one has 20, by turns.
After a refusal, a connection of the greedy one waits as long as a frame took with one: so the 20 offer 20 times the
share of one client.
"""

import contextlib
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

from harness.processes import Server
from support.effort import Effort
from support.exchange import Lost, connect, exchange, request
from support.keys import write_keys
from support.lookdown import DETECT, lookdown
from support.places import OFFICE
from support.row import Row

OTHERS = 4
TIMES = 20
LEAST_THROUGHPUT = 0.9
"""Fraction that remains to the others."""
MOST_P99 = 1.5
"""Factor of the others' p99."""
ROUNDS = 2
"""Times that the two loads take turns, because the machine may be slower for a while."""
WARM_UP_SECONDS = 2.0


class Client(threading.Thread):
    """A connection that sends frames without a pause until `ends_at`, and records the served ones."""

    def __init__(self, server: Server, key: str, begins_at: float, ends_at: float, pause_seconds: float):
        super().__init__()
        headers = {"Content-Type": "image/jpeg", "X-API-Key": key}
        self._sent = request("POST", DETECT, OFFICE.read_bytes(), headers)
        self._address, self._begins_at, self._ends_at = server.address, begins_at, ends_at
        self._pause_seconds = pause_seconds
        self.seconds: list[float] = []
        self.statuses: Counter[int] = Counter()

    def run(self) -> None:
        """Runs until the end."""
        while time.monotonic() < self._ends_at:
            with contextlib.suppress(Lost, OSError), contextlib.closing(connect(self._address)) as connection:
                while time.monotonic() < self._ends_at:
                    self._ask(connection)

    def _ask(self, connection) -> None:
        asked = time.monotonic()
        status = exchange(connection, self._sent).status
        ended = time.monotonic()
        if self._begins_at <= ended <= self._ends_at:
            self.statuses[status] += 1
            if status == 200:
                self.seconds.append(ended - asked)
        if status != 200:
            time.sleep(self._pause_seconds)


def prove(effort: Effort) -> list[Row]:
    """Runs with the default settings and a real model."""
    seconds = effort.fairness_seconds
    row = Row(
        "a greedy client",
        f"{OTHERS} keys with one connection each, and one key with 1 and with {TIMES}, {seconds:.0f} s each, profile "
        "`fast`, closed loop",
    )
    names = ["greedy", *(f"other-{index}" for index in range(OTHERS))]
    with tempfile.TemporaryDirectory() as folder:
        keys = Path(folder) / "keys.toml"
        write_keys(keys, {name: f"lookdown_{name}" for name in names})
        with lookdown({"LOG__FILTER": "error", "ACCESS__KEYS_FILE": str(keys)}) as server:
            calm, storm, greedy = [], [], Counter()
            for _ in range(ROUNDS):
                response_seconds, modest = _load(server, names, 1, seconds / ROUNDS, pause_seconds=0.0)
                calm += response_seconds
                pause_seconds = seconds / ROUNDS / max(modest[200], 1)
                response_seconds, statuses = _load(server, names, TIMES, seconds / ROUNDS, pause_seconds)
                storm += response_seconds
                greedy += statuses
    throughput = len(storm) / max(len(calm), 1)
    calm_p99, storm_p99 = _p99(calm), _p99(storm)
    served, refused = greedy[200], greedy[429]
    row.seen = (
        f"the others: {len(calm) / seconds:.1f} → {len(storm) / seconds:.1f} frames/s ({throughput:.2f}), p99 "
        f"{1000 * calm_p99:.0f} → {1000 * storm_p99:.0f} ms; the greedy one: {served / seconds:.1f} frames/s, "
        f"{refused} refused"
    )
    row.require(len(calm) >= 20, f"only {len(calm)} frames were served")
    row.require(throughput >= LEAST_THROUGHPUT, f"{throughput:.2f} of the others' throughput remained")
    row.require(storm_p99 <= MOST_P99 * calm_p99, f"the others' p99 grew by {storm_p99 / calm_p99:.2f}")
    row.require(set(greedy) <= {200, 429}, f"the greedy one was answered {greedy}")
    return [row]


def _load(
    server: Server, names: list[str], greedy: int, seconds: float, pause_seconds: float
) -> tuple[list[float], Counter[int]]:
    """Returns the response times of the others' frames, and the counts of the greedy client's statuses.

    `greedy` is the number of the greedy client's connections, `pause_seconds` the pause of a connection after a refusal.
    """
    begins_at = time.monotonic() + WARM_UP_SECONDS
    keys = [names[0]] * greedy + names[1:]
    clients = [Client(server, f"lookdown_{name}", begins_at, begins_at + seconds, pause_seconds) for name in keys]
    for client in clients:
        client.start()
    for client in clients:
        client.join()
    statuses = sum((client.statuses for client in clients[:greedy]), Counter())
    return [second for client in clients[greedy:] for second in client.seconds], statuses


def _p99(seconds: list[float]) -> float:
    return sorted(seconds)[len(seconds) * 99 // 100] if seconds else float("inf")
