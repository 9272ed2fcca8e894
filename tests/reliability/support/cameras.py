"""Cameras that misbehave, over HTTP and RTSP, and an HTTP camera that works."""

import contextlib
import re
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from harness.places import SAMPLES

MULTIPART = b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=B\r\n\r\n"
PART_BYTES = (12 << 20) - 1000
"""Memory of such frames comes from the heaps of malloc, which keep it, unless a variable makes them return it."""
FRAME: Path = SAMPLES / "office.jpg"
DESCRIPTION = (
    "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=x\r\nc=IN IP4 127.0.0.1\r\nt=0 0\r\n"
    "m=video 0 RTP/AVP 96\r\na=rtpmap:96 H264/90000\r\n"
    "a=fmtp:96 packetization-mode=1\r\na=control:track1\r\n"
)
STREAM = "m=video 0 RTP/AVP 96\r\na=rtpmap:96 H264/90000\r\na=control:t\r\n"
PACKET_BYTES = 60000
FRAME_SECONDS = 0.2
SINGLE_SLICE, KEY_SLICE, FRAGMENT = 1, 5, 28
"""Types of H.264 units (RFC 6184)."""


def heads(connection: socket.socket) -> Iterator[bytes]:
    """Yields the heads of requests without bodies until the client closes the connection."""
    received = b""
    while chunk := connection.recv(65536):
        received += chunk
        while b"\r\n\r\n" in received:
            head, _, received = received.partition(b"\r\n\r\n")
            yield head


@contextlib.contextmanager
def listening(serve: Callable[[socket.socket], None]) -> Iterator[int]:
    """Serves each connection in a thread of its own, and yields the port."""
    listener = socket.create_server(("127.0.0.1", 0), backlog=200)

    def accept() -> None:
        with contextlib.suppress(OSError):
            while True:
                connection, _ = listener.accept()
                threading.Thread(target=one, args=(connection,), daemon=True).start()

    def one(connection: socket.socket) -> None:
        with contextlib.suppress(OSError), contextlib.closing(connection):
            serve(connection)

    threading.Thread(target=accept, daemon=True).start()
    with contextlib.closing(listener):
        yield listener.getsockname()[1]


@contextlib.contextmanager
def http_camera() -> Iterator[str]:
    """Starts a server whose paths are cameras: `good`, `provisional` and `large`. Yields its URL."""
    with listening(_serve) as port:
        yield f"http://127.0.0.1:{port}"


def _serve(connection: socket.socket) -> None:
    for head in heads(connection):
        path = head.split(b" ")[1].strip(b"/")
        if path.startswith(b"provisional"):
            while True:
                connection.sendall(b"HTTP/1.1 100 Continue\r\n\r\n" * 1000)
        if path.startswith(b"large"):
            connection.sendall(MULTIPART)
            start, end = b"\xff\xd8\xff\xda\x00\x02", b"\xff\xd9"
            frame = start + b"x" * (PART_BYTES - len(start) - len(end)) + end
            while True:
                connection.sendall(b"--B\r\nContent-Length: %d\r\n\r\n" % len(frame) + frame + b"\r\n")
        image = FRAME.read_bytes()
        answer = b"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(image)
        connection.sendall(answer + image)


@dataclass
class RtspServer:
    """A listening server, with the heads of the requests that it received."""

    port: int = 0
    heads: list[str] = field(default_factory=list)

    @property
    def url(self) -> str:
        """The address with a user and a password."""
        return f"rtsp://viewer:geheim@127.0.0.1:{self.port}/stream"


@contextlib.contextmanager
def rtsp_server(*, redirect: str = "", streams: int = 0, video: bytes = b"") -> Iterator[RtspServer]:
    """Starts a server that redirects, describes many streams, or sends H.264."""
    server = RtspServer()

    def serve(connection: socket.socket) -> None:
        for head in heads(connection):
            server.heads.append(head.decode("latin1"))
            connection.sendall(_answer(server.heads[-1], redirect, streams))
            if head.startswith(b"PLAY") and video:
                _play(connection, video)

    with listening(serve) as server.port:
        yield server


def _answer(head: str, redirect: str, streams: int) -> bytes:
    method = head.split()[0]
    sequence = next(line for line in head.split("\r\n") if line.startswith("CSeq"))
    status, extra, body = "200 OK", "", ""
    if method == "DESCRIBE" and redirect:
        status, extra = "302 Found", f"Location: {redirect}\r\n"
    elif method == "DESCRIBE":
        body = DESCRIPTION + STREAM * streams
        extra = f"Content-Type: application/sdp\r\nContent-Length: {len(body)}\r\n"
    elif method == "SETUP":
        extra = "Transport: RTP/AVP/TCP;unicast;interleaved=0-1\r\nSession: 1\r\n"
    elif method == "PLAY":
        extra = "Session: 1\r\n"
    return f"RTSP/1.0 {status}\r\n{sequence}\r\n{extra}\r\n{body}".encode("latin1")


def _play(connection: socket.socket, video: bytes) -> None:
    units = [unit for unit in re.split(b"\x00\x00\x00\x01|\x00\x00\x01", video) if unit]
    number = stamp = 0
    while True:
        for unit in units:
            kind = unit[0] & 31
            ends_frame = kind in (SINGLE_SLICE, KEY_SLICE)
            payloads = [unit]
            if len(unit) > PACKET_BYTES:
                rest = range(1, len(unit), PACKET_BYTES)
                first, last = rest[0], rest[-1]
                payloads = [
                    bytes([(unit[0] & 0xE0) | FRAGMENT, (0x80 * (at == first)) | (0x40 * (at == last)) | kind])
                    + unit[at : at + PACKET_BYTES]
                    for at in rest
                ]
            for payload in payloads:
                mark = 0x80 if ends_frame and payload is payloads[-1] else 0
                packet = struct.pack(">BBHII", 0x80, 96 | mark, number & 0xFFFF, stamp & 0xFFFFFFFF, 1) + payload
                connection.sendall(b"$\0" + struct.pack(">H", len(packet)) + packet)
                number += 1
            if ends_frame:
                stamp += 90000
                time.sleep(FRAME_SECONDS)
