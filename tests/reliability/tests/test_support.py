"""Tests of the measurements: growth and lost answers."""

import contextlib
import socket
import threading
import unittest

from support.exchange import Lost, ask, connect
from support.holdings import growth


def answering(sent: bytes):
    """Starts a server that answers one connection with these bytes and closes it. Returns its address and thread."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        with contextlib.closing(listener), contextlib.closing(listener.accept()[0]) as connection:
            connection.recv(65536)
            connection.sendall(sent)

    thread = threading.Thread(target=serve)
    thread.start()
    return f"127.0.0.1:{listener.getsockname()[1]}", thread


class Growth(unittest.TestCase):
    def test_growth_is_the_rise_of_the_line(self):
        self.assertAlmostEqual(growth([(second, 5.0 + 2.0 * second) for second in range(11)]), 20.0)

    def test_fluctuation_is_no_growth(self):
        self.assertAlmostEqual(growth([(0, 1), (1, 2), (2, 1), (3, 2), (4, 1)]), 0.0)


class Exchange(unittest.TestCase):
    def test_an_answer_that_ends_early_is_lost(self):
        for sent in (b"", b"HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhal"):
            address, thread = answering(sent)
            with self.assertRaises(Lost):
                ask(address, "GET", "/")
            thread.join()

    def test_a_whole_answer_is_read(self):
        address, thread = answering(b"HTTP/1.1 404 Not Found\r\nETag: x\r\nContent-Length: 2\r\n\r\n{}")
        answer = ask(address, "GET", "/")
        thread.join()
        self.assertEqual((answer.status, answer.headers["etag"], answer.json()), (404, "x", {}))

    def test_a_missing_server_refuses_connections(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
        with self.assertRaises(ConnectionRefusedError):
            connect(f"127.0.0.1:{port}")
