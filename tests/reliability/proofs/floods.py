"""Floods without a valid key: `/livez` and `/readyz` of the metrics port are answered within a second beside each of them.

The image, the manifests and the Debian package set that port. Connections to the main port wait for one another.
"""

import contextlib
import hashlib
import multiprocessing
import shutil
import socket
import ssl
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from harness.places import LOOKDOWN
from harness.processes import free_ports, running
from support.effort import Effort
from support.exchange import Lost, connect, exchange, read_answer, request
from support.lookdown import AT_ONCE, DETECT, TINY, lookdown
from support.places import SAMPLES
from support.row import Row

MOST_SECONDS = 1.0
"""Longest wait of a probe."""
PROBE_EVERY_SECONDS = 0.05
STARTING_SECONDS = 30.0
"""Longest time in which a flood starts."""
LONGEST_SECONDS = 120.0
"""Time after which a flood ends by itself."""
FORM = "/v1/vision/detection"
EDGE = "edge"
LARGE = 8 << 20
PIECE = 1 << 16
DRIP_SECONDS = 0.2
WRONG_KEY = {"X-API-Key": "lookdown_wrong"}
KEYS = {"gate": "lookdown_gate", "office": "lookdown_office"}


def prove(effort: Effort) -> list[Row]:
    """Returns a row for each flood."""
    with tempfile.TemporaryDirectory() as folder:
        keys = Path(folder) / "keys.toml"
        digests = {name: hashlib.sha256(key.encode()).hexdigest() for name, key in KEYS.items()}
        rows = [f'{name} = {{ scopes = ["detect"], sha256 = "{digest}" }}\n' for name, digest in digests.items()]
        keys.write_text("".join(rows), encoding="utf-8")
        settings = TINY | {"LOG__FILTER": "error", "ACCESS__KEYS_FILE": str(keys)}
        with _flooded(settings) as addresses:
            floods: dict[str, Callable[[str, float], None]] = {
                "silent connections": _silent,
                "connections at rest after an answer": _at_rest,
                "request heads, a byte now and then": _slow_head,
                "slow DeepStack forms": _slow_form,
                "event streams without a key": _event_stream,
                "large bodies with wrong keys": _large_body,
            }
            rows = [_flood(addresses, name, client, effort) for name, client in floods.items()]
        return [*rows, *_with_open_streams(effort), *_with_tls(effort, settings, Path(folder))]


def _with_open_streams(effort: Effort) -> list[Row]:
    """A server without keys, on which every client may open event streams."""
    with _flooded(TINY | {"LOG__FILTER": "error"}) as addresses:
        return [_flood(addresses, "event streams of a server without keys", _event_stream, effort)]


@contextlib.contextmanager
def _flooded(settings: dict[str, str]) -> Iterator[tuple[str, str]]:
    """Starts a server, and yields its address and that of its probes."""
    (port,) = free_ports(1)
    probes = f"127.0.0.1:{port}"
    with lookdown(settings | {"SERVER__METRICS_LISTEN": probes}) as server:
        yield server.address, probes


def _with_tls(effort: Effort, settings: dict[str, str], folder: Path) -> list[Row]:
    names = ["TLS handshakes, unfinished", "TLS handshakes, one after the other"]
    if not shutil.which("openssl"):
        return [Row(name, "needs openssl", skipped="openssl is not installed") for name in names]
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    made = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 1 -subj /CN=localhost"
    subprocess.run([*made.split(), "-keyout", key, "-out", certificate], check=True, capture_output=True)
    tls = {"SERVER__TLS__CERTIFICATE": str(certificate), "SERVER__TLS__PRIVATE_KEY": str(key)}
    port, probe_port = free_ports(2)
    wanted = (
        settings
        | AT_ONCE
        | tls
        | {
            "SERVER__LISTEN": f"127.0.0.1:{port}",
            "SERVER__METRICS_LISTEN": f"127.0.0.1:{probe_port}",
            "CALIBRATIONS__PATH": str(SAMPLES / "calibrations"),
        }
    )
    variables = {f"LOOKDOWN__{name}": value for name, value in wanted.items()}
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE

    def over_tls(address: str, timeout: float = 30.0) -> socket.socket:
        return context.wrap_socket(connect(address, timeout))

    def unfinished(address: str, ends_at: float) -> None:
        with contextlib.closing(connect(address)) as connection:
            connection.sendall(b"\x16\x03\x01\x02\x00\x01\x00")
            _rest(connection, ends_at)

    def finished(address: str, ends_at: float) -> None:
        over_tls(address, max(0.1, ends_at - time.monotonic())).close()

    with running("lookdown", [str(LOOKDOWN), "serve"], probe_port, "/readyz", variables):
        addresses = f"127.0.0.1:{port}", f"127.0.0.1:{probe_port}"
        clients = zip(names, (unfinished, finished), strict=True)
        return [_flood(addresses, name, client, effort) for name, client in clients]


def _flood(addresses: tuple[str, str], name: str, client: Callable, effort: Effort) -> Row:
    """Repeats the client in many threads of another process, and asks the probes at the second address meanwhile."""
    address, probes = addresses
    count, seconds = effort.flood_clients, effort.flood_seconds
    row = Row(f"flood: {name}", f"{count} clients at a time for {seconds:.0f} s, and probes on new connections")
    processes = multiprocessing.get_context("fork")
    begun = processes.Event()
    flood = processes.Process(target=_repeat_all, args=(client, address, count, begun), daemon=True)
    flood.start()
    begun.wait(STARTING_SECONDS)
    waits, wrong = [], []
    ends_at = time.monotonic() + seconds
    while time.monotonic() < ends_at:
        for path in ("/livez", "/readyz"):
            asked = time.monotonic()
            try:
                with contextlib.closing(connect(probes, 5.0)) as connection:
                    status = exchange(connection, request("GET", path, headers={"Connection": "close"})).status
            except (Lost, OSError) as error:
                status = f"none ({error})"
            waits.append(time.monotonic() - asked)
            if status != 200:
                wrong.append(f"{path}: {status}")
        time.sleep(PROBE_EVERY_SECONDS)
    flood.kill()
    flood.join()
    waits.sort()
    p99 = waits[len(waits) * 99 // 100]
    row.seen = f"{len(waits)} probes, slowest {max(waits):.2f} s, p99 {p99:.2f} s; {len(wrong)} not answered with 200"
    row.require(not wrong, f"a probe was not answered with 200: {wrong[:1]}")
    row.require(max(waits) <= MOST_SECONDS, f"a probe took {max(waits):.2f} s")
    return row


def _repeat_all(client: Callable[[str, float], None], address: str, count: int, begun) -> None:
    ends_at = time.monotonic() + LONGEST_SECONDS
    threads = [threading.Thread(target=_repeat, args=(client, address, ends_at)) for _ in range(count)]
    for thread in threads:
        thread.start()
    begun.set()
    for thread in threads:
        thread.join()


def _repeat(client: Callable[[str, float], None], address: str, ends_at: float) -> None:
    while time.monotonic() < ends_at:
        with contextlib.suppress(OSError, Lost):
            client(address, ends_at)
        time.sleep(0.01)


def _rest(connection: socket.socket, ends_at: float) -> None:
    """Keeps the connection until the server closes it or the flood ends."""
    connection.settimeout(max(0.1, ends_at - time.monotonic()))
    while connection.recv(4096):
        pass


def _drip(connection: socket.socket, piece: bytes, ends_at: float) -> None:
    """Sends small pieces until the server answers or closes, or the flood ends."""
    connection.settimeout(DRIP_SECONDS)
    while time.monotonic() < ends_at:
        connection.sendall(piece)
        try:
            if not connection.recv(4096):
                return
        except TimeoutError:
            continue


def _silent(address: str, ends_at: float) -> None:
    with contextlib.closing(connect(address)) as connection:
        _rest(connection, ends_at)


def _at_rest(address: str, ends_at: float) -> None:
    with contextlib.closing(connect(address)) as connection:
        connection.sendall(request("GET", "/livez"))
        read_answer(connection)
        _rest(connection, ends_at)


def _slow_head(address: str, ends_at: float) -> None:
    with contextlib.closing(connect(address)) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: lookdown\r\nX-A: ")
        _drip(connection, b"a", ends_at)


def _slow_form(address: str, ends_at: float) -> None:
    head = f"POST {FORM} HTTP/1.1\r\nHost: lookdown\r\nContent-Length: {LARGE}\r\n"
    head += f"Content-Type: multipart/form-data; boundary={EDGE}\r\n\r\n--{EDGE}\r\n"
    part = 'Content-Disposition: form-data; name="image"; filename="a.jpg"\r\n\r\n'
    with contextlib.closing(connect(address)) as connection:
        connection.sendall((head + part).encode() + bytes(PIECE))
        _drip(connection, bytes(512), ends_at)


def _event_stream(address: str, ends_at: float) -> None:
    with contextlib.closing(connect(address)) as connection:
        connection.sendall(request("GET", "/events"))
        _rest(connection, ends_at)


def _large_body(address: str, ends_at: float) -> None:
    head = request("POST", DETECT, b"", WRONG_KEY).replace(b"Content-Length: 0", f"Content-Length: {LARGE}".encode())
    with contextlib.closing(connect(address)) as connection:
        connection.settimeout(max(0.1, ends_at - time.monotonic()))
        connection.sendall(head)
        for _ in range(LARGE // PIECE):
            if time.monotonic() > ends_at:
                return
            connection.sendall(bytes(PIECE))
        read_answer(connection)
