"""Heads of requests that a server reads."""

import socket
from collections.abc import Iterator


def heads(connection: socket.socket) -> Iterator[bytes]:
    """Yields the heads of requests without bodies until the client closes the connection."""
    received = b""
    while chunk := connection.recv(65536):
        received += chunk
        while b"\r\n\r\n" in received:
            head, _, received = received.partition(b"\r\n\r\n")
            yield head
