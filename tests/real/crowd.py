"""Clients that send requests continuously until they are stopped, with the outcome of each request."""

import collections
import contextlib
import http.client
import threading
import time
from collections.abc import Iterator

LOST = {0, 502, 503, 504}
"""No answer, or an answer of HAProxy that it got none."""


class Crowd:
    """The outcomes that the clients observed."""

    def __init__(self):
        self.statuses: collections.Counter[int] = collections.Counter()
        self.replicas: collections.Counter[str] = collections.Counter()
        self.lost_starts: list[float] = []
        """When each lost request began, on the clock of `time.monotonic`."""
        self.stopped = threading.Event()
        self._lock = threading.Lock()

    @property
    def lost(self) -> int:
        """The number of requests without an answer from a replica."""
        return len(self.lost_starts)

    def count(self, started: float, status: int, replica: str) -> None:
        """Counts a request that began at `started`."""
        with self._lock:
            self.statuses[status] += 1
            self.replicas[replica] += 1
            if status in LOST:
                self.lost_starts.append(started)

    def ask(self, address: str, path: str, body: bytes, headers: dict[str, str]) -> None:
        """Runs one client, on a connection that it keeps for as long as possible."""
        connection = http.client.HTTPConnection(address, timeout=30)
        while not self.stopped.is_set():
            started = time.monotonic()
            try:
                connection.request("POST", path, body, headers)
                answer = connection.getresponse()
                answer.read()
                self.count(started, answer.status, answer.getheader("x-replica", ""))
            except (OSError, http.client.HTTPException):
                self.count(started, 0, "")
                connection.close()


@contextlib.contextmanager
def crowd(address: str, path: str, body: bytes, headers: dict[str, str], clients: int) -> Iterator[Crowd]:
    """Runs clients while this is open. All have their last answer when it closes."""
    seen = Crowd()
    threads = [threading.Thread(target=seen.ask, args=(address, path, body, headers)) for _ in range(clients)]
    for thread in threads:
        thread.start()
    try:
        yield seen
    finally:
        seen.stopped.set()
        for thread in threads:
            thread.join()


def rate(seen: Crowd, seconds: float) -> float:
    """The number of successful answers per second, from now on."""
    before = seen.statuses[200]
    time.sleep(seconds)
    return (seen.statuses[200] - before) / seconds
