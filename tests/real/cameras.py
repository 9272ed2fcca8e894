"""Cameras for the tests: an MJPEG stream, a snapshot behind Digest, RTSP, and a proxy that damages connections."""

import contextlib
import hashlib
import http.server
import json
import re
import secrets
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from harness.places import SAMPLES
from harness.processes import free_ports
from state import wait_until

HERE = Path(__file__).resolve().parent
USER, PASSWORD = "viewer", "s@cret/of:gate"
REALM = "camera"
CHUNK = 4096
CLOCK_BITS = 24
"""Bits of the milliseconds that `rtsp_clock` shows: 4.6 hours."""


class Handler(http.server.BaseHTTPRequestHandler):
    """Answers HTTP requests, and logs nothing."""

    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        """Logs nothing."""

    def answer(self, status: int, body: bytes = b"", *headers: tuple[str, str]) -> None:
        """Sends a whole response."""
        self.send_response(status)
        for name, value in (*headers, ("Content-Length", str(len(body)))):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)


@contextlib.contextmanager
def serving(handler: type[Handler]) -> Iterator[int]:
    """Serves requests in threads, and yields the port."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield server.server_port
    finally:
        server.shutdown()
        server.server_close()


class _Camera(Handler):
    """`/stream` is MJPEG, `/snap` a snapshot behind Digest with an entity tag."""

    frames: list[bytes]
    rate: float

    def do_GET(self):
        """Answers a request."""
        with contextlib.suppress(OSError):
            if self.path == "/stream":
                self._stream()
            else:
                self._snapshot()

    def _frame(self) -> bytes:
        return self.frames[int(time.monotonic() * self.rate) % len(self.frames)]

    def _stream(self) -> None:
        self.close_connection = True
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        while True:
            frame = self._frame()
            head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(frame)}\r\n\r\n"
            self.wfile.write(head.encode() + frame + b"\r\n")
            time.sleep(1.0 / self.rate)

    def _snapshot(self) -> None:
        if not self._is_authorized():
            challenge = f'Digest realm="{REALM}", qop="auth", nonce="{secrets.token_hex(8)}", algorithm=MD5'
            basic = f'Basic realm="{REALM}"'
            self.answer(401, b"", ("WWW-Authenticate", basic), ("WWW-Authenticate", challenge))
            return
        frame = self._frame()
        tag = f'"{hashlib.md5(frame).hexdigest()}"'
        if self.headers.get("If-None-Match") == tag:
            self.send_response(304)
            self.end_headers()
            return
        self.answer(200, frame, ("Content-Type", "image/jpeg"), ("ETag", tag))

    def _is_authorized(self) -> bool:
        header = self.headers.get("Authorization", "")
        given = {key: quoted or plain for key, quoted, plain in re.findall(r'(\w+)=(?:"([^"]*)"|([^",\s]+))', header)}
        if not header.startswith("Digest ") or given.get("username") != USER:
            return False

        def digest(*parts: str) -> str:
            return hashlib.md5(":".join(parts).encode()).hexdigest()

        first, second = digest(USER, REALM, PASSWORD), digest("GET", given["uri"])
        return given["response"] == digest(first, given["nonce"], given["nc"], given["cnonce"], given["qop"], second)


@contextlib.contextmanager
def http_camera(frames: list[bytes], rate: float) -> Iterator[int]:
    """Serves a camera over HTTP, and yields its port."""
    with serving(type("Camera", (_Camera,), {"frames": frames, "rate": rate})) as port:
        yield port


def empty_frame(side: int = 960) -> bytes:
    """A gray JPEG without persons."""
    gray = ["-f", "lavfi", "-i", f"color=gray:size={side}x{side}", "-frames:v", "1", "-f", "mjpeg", "-"]
    return subprocess.run(["ffmpeg", "-v", "error", *gray], capture_output=True, check=True).stdout


def office_calibration(folder: Path, **more: object) -> Path:
    """Creates a folder with the calibration of the sample `office` and these keys, such as zones."""
    folder.mkdir(exist_ok=True)
    calibration = json.loads((SAMPLES / "calibrations" / "office.json").read_text(encoding="utf-8"))
    (folder / "office.json").write_text(json.dumps(calibration | more), encoding="utf-8")
    return folder


@contextlib.contextmanager
def rtsp_camera(folder: Path, rate: int, *login: str) -> Iterator[int]:
    """Serves the files `0.jpg`, `1.jpg` … of a folder over RTSP, and yields the port."""
    with _rtsp_server(folder, str(rate), *login) as port:
        yield port


@contextlib.contextmanager
def rtsp_clock(rate: int) -> Iterator[int]:
    """Serves images that show the time over RTSP, and yields the port."""
    with _rtsp_server("clock", str(rate), str(CLOCK_BITS)) as port:
        yield port


@contextlib.contextmanager
def _rtsp_server(*arguments: object) -> Iterator[int]:
    (port,) = free_ports(1)
    command = ["/usr/bin/python3", HERE / "rtsp_server.py", str(port), *arguments]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def answers() -> bool:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1):
            return True
        return False

    try:
        wait_until(answers, "the RTSP server answers")
        yield port
    finally:
        process.kill()
        process.wait()


def shown_milliseconds(image: bytes) -> int:
    """The lowest bits of the time that an image of `rtsp_clock` shows."""
    strip = ["-vf", f"scale={CLOCK_BITS}:12:flags=area,crop={CLOCK_BITS}:1:0:0,format=gray", "-f", "rawvideo", "-"]
    command = ["ffmpeg", "-v", "error", "-i", "-", *strip]
    row = subprocess.run(command, input=image, capture_output=True, check=True).stdout
    return int("".join("1" if value > 127 else "0" for value in row), 2)


class Proxy:
    """Forwards connections to a port, and damages them: `mode` is `normal`, `killed`, `stalled`, `cut` or `corrupted`."""

    def __init__(self, target: int):
        self.target = target
        self.mode = "normal"
        self.open: set[socket.socket] = set()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def set(self, mode: str) -> None:
        """Changes the mode. `killed` closes all connections at once."""
        self.mode = mode
        if mode == "killed":
            for connection in list(self.open):
                self._close(connection)

    def close(self) -> None:
        """Ends the proxy."""
        self.set("killed")
        self.listener.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _ = self.listener.accept()
                if self.mode == "killed":
                    client.close()
                    continue
                try:
                    server = socket.create_connection(("127.0.0.1", self.target), timeout=5)
                except OSError:
                    client.close()
                    continue
                server.settimeout(None)
                self.open |= {client, server}
                for source, sink, is_answer in ((client, server, False), (server, client, True)):
                    threading.Thread(target=self._forward, args=(source, sink, is_answer), daemon=True).start()

    def _forward(self, source: socket.socket, sink: socket.socket, is_answer: bool) -> None:
        with contextlib.suppress(OSError):
            while chunk := source.recv(CHUNK):
                while self.mode == "stalled":
                    time.sleep(0.05)
                if is_answer and self.mode == "cut":
                    sink.sendall(chunk[: len(chunk) // 2])
                    break
                if is_answer and self.mode == "corrupted":
                    damaged = bytearray(chunk)
                    damaged[:: max(1, len(damaged) // 8)] = b"\xff" * len(damaged[:: max(1, len(damaged) // 8)])
                    chunk = bytes(damaged)
                sink.sendall(chunk)
        for connection in (source, sink):
            self._close(connection)

    def _close(self, connection: socket.socket) -> None:
        self.open.discard(connection)
        with contextlib.suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)
        connection.close()


@contextlib.contextmanager
def proxy(target: int) -> Iterator[Proxy]:
    """A proxy in front of a port."""
    started = Proxy(target)
    try:
        yield started
    finally:
        started.close()
