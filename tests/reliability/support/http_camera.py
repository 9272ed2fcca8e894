"""HTTP cameras: one that works, and ones that misbehave."""

import contextlib
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

from harness.places import SAMPLES

from .heads import heads

MULTIPART = b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=B\r\n\r\n"
PART_BYTES = (12 << 20) - 1000
"""Memory of such frames comes from the heaps of malloc, which keep it, unless a variable makes them return it."""
FRAME: Path = SAMPLES / "office.jpg"


@contextlib.contextmanager
def http_camera() -> Iterator[str]:
    """Starts a server whose paths are cameras: `good`, `provisional` and `large`. Yields its URL."""
    listener = socket.create_server(("127.0.0.1", 0), backlog=200)

    def accept() -> None:
        with contextlib.suppress(OSError):
            while True:
                connection, _ = listener.accept()
                threading.Thread(target=_serve, args=(connection,), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    with contextlib.closing(listener):
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"


def _serve(connection: socket.socket) -> None:
    with contextlib.suppress(OSError), contextlib.closing(connection):
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
