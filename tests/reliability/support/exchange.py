"""One request with its exact outcome."""

import contextlib
import http.client
import json
import socket
from dataclasses import dataclass


@dataclass(frozen=True)
class Answer:
    """The answer of a server."""

    status: int
    headers: dict[str, str]
    body: bytes

    def json(self) -> dict:
        """The body as JSON."""
        return json.loads(self.body)


class Lost(Exception):
    """A connection was made, but no complete answer was received."""


def connect(address: str, timeout: float = 30.0) -> socket.socket:
    """Opens a connection. Raises `ConnectionRefusedError` if no server listens."""
    host, _, port = address.rpartition(":")
    connection = socket.create_connection((host, int(port)), timeout)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection


def request(method: str, path: str, body: bytes = b"", headers: dict[str, str] | None = None) -> bytes:
    """A request as bytes."""
    fields = {"Host": "lookdown", "Content-Length": str(len(body)), **(headers or {})}
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in fields.items())]
    return "\r\n".join(lines).encode() + b"\r\n\r\n" + body


def read_answer(connection: socket.socket) -> Answer:
    """Reads the complete answer to a request."""
    answer = http.client.HTTPResponse(connection)
    try:
        answer.begin()
        return Answer(answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read())
    except (OSError, http.client.HTTPException) as error:
        raise Lost(f"{type(error).__name__}: {error}") from None


def exchange(connection: socket.socket, sent: bytes) -> Answer:
    """Sends a request on a connection and reads the answer, even if it comes before everything is sent."""
    with contextlib.suppress(ConnectionError):
        connection.sendall(sent)
    return read_answer(connection)


def ask(
    address: str,
    method: str,
    path: str,
    body: bytes = b"",
    headers: dict[str, str] | None = None,
    timeout: float = 30.0,
) -> Answer:
    """The answer to one request on its own connection."""
    fields = {"Connection": "close", **(headers or {})}
    with contextlib.closing(connect(address, timeout)) as connection:
        return exchange(connection, request(method, path, body, fields))


def vanish(connection: socket.socket) -> None:
    """Ends a connection with a reset, like a client that has crashed."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\x00\x00\x00\x00\x00\x00\x00")
    connection.close()
