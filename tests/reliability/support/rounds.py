"""Clients that send requests until the server no longer listens."""

import collections
import contextlib
import random
import socket
import threading
import time
from collections.abc import Callable

from .exchange import Answer, Lost, connect, read_answer


class Tally:
    """Counts the outcomes of requests of several clients."""

    def __init__(self):
        self._lock = threading.Lock()
        self.statuses: collections.Counter[int] = collections.Counter()
        self.lost: list[str] = []

    def answered(self, answer: Answer) -> None:
        """Counts an answer."""
        with self._lock:
            self.statuses[answer.status] += 1

    def lose(self, how: str) -> None:
        """Counts a request whose client got no answer."""
        with self._lock:
            self.lost.append(how)

    def asked(self) -> int:
        """The number of all requests."""
        return self.statuses.total() + len(self.lost)


class Client(threading.Thread):
    """Sends one request repeatedly, on a new connection each time or on one for as long as the server keeps it.

    It ends when its connection is refused, as the server is gone then. Any other missing answer is a loss, including
    the reset of a connection that the server never accepted.
    """

    def __init__(self, address: str, sent: Callable[[], bytes], tally: Tally, *, keeps: bool, slowly: bool = False):
        super().__init__()
        self._address, self._sent, self._tally = address, sent, tally
        self._keeps, self._slowly = keeps, slowly
        self._connection: socket.socket | None = None

    def run(self) -> None:
        """Runs until the connection is refused."""
        kind = "kept" if self._keeps else "new"
        while True:
            reused = self._connection is not None
            try:
                connection = self._connection or connect(self._address)
            except ConnectionRefusedError:
                return
            except OSError as error:
                self._tally.lose(f"connecting: {error}")
                continue
            try:
                answer = self._exchange(connection)
                self._tally.answered(answer)
            except (Lost, OSError) as error:
                self._tally.lose(f"{kind}{', used before' if reused else ''}: {error}")
                self._drop(connection)
                continue
            if self._keeps and answer.headers.get("connection") != "close":
                self._connection = connection
            else:
                self._drop(connection)

    def _exchange(self, connection: socket.socket) -> Answer:
        sent = self._sent()
        pieces = [sent]
        if self._slowly:
            third = len(sent) // 3
            pieces = [sent[:third], sent[third : 2 * third], sent[2 * third :]]
        with contextlib.suppress(ConnectionError):
            for piece in pieces:
                connection.sendall(piece)
                if self._slowly:
                    time.sleep(random.uniform(0.0, 0.03))
        return read_answer(connection)

    def _drop(self, connection: socket.socket) -> None:
        connection.close()
        self._connection = None
