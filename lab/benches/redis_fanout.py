"""Measures the CPU time of Redis for a report: `redis_fanout.py` prints Markdown. Needs `redis-server`.

Simulated replicas send the commands of the server (src/results/redis) to a real Redis on this machine. Each has a
connection that stores reports, and one that is subscribed to the cameras of its listeners. First the reports arrive
one by one, for several numbers of replicas. Every camera has one listener, so that each report is delivered once.
Then 64 replicas store one report per second of 10,000 cameras, a tenth of them with a listener. The store is full
during the measurement: each report evicts another one.
"""

import contextlib
import hashlib
import json
import multiprocessing
import selectors
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parents[2] / "src" / "results" / "redis"
SCRIPT = "".join((SCRIPTS / name).read_text(encoding="utf-8") for name in ("forget.lua", "record.lua"))
SHA = hashlib.sha1(SCRIPT.encode(), usedforsecurity=False).hexdigest()
TAG = "{lookdown}"
REPORT = json.dumps({"persons": [{"box": [index, 2.5, 3.5, 4.5]} for index in range(64)]}).encode()[:2268].ljust(2268)
KIND = b"smessage\r\n"
REPORTS = 20_000
KEPT = 10_000
MANY_CAMERAS = 10_000
RATE_SECONDS = 20.0


def command(*words: object) -> bytes:
    """A command as bytes (RESP)."""
    parts = [word if isinstance(word, bytes) else str(word).encode() for word in words]
    return b"*%d\r\n" % len(parts) + b"".join(b"$%d\r\n%s\r\n" % (len(part), part) for part in parts)


class Connection:
    """A connection to Redis."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def ask(self, *words: object) -> bytes:
        """The reply to a command, as far as it arrives at once."""
        self.socket.sendall(command(*words))
        return self.socket.recv(1 << 16)

    def info(self) -> dict[str, float]:
        """The CPU times of Redis in seconds."""
        lines = self.ask("INFO", "cpu").decode().splitlines()
        return {name: float(value) for name, value in (line.split(":") for line in lines if line.startswith("used_"))}


def channel(camera: str) -> str:
    """The channel of a camera."""
    return f"{TAG}:0:camera:{camera}"


class Replica:
    """A replica that stores reports."""

    def __init__(self, port: int, number: int, cameras: int) -> None:
        self.connection = Connection(port)
        self._sender = f"replica-{number:08}"
        self._sent = 0
        self._limits = (cameras, 100, max(KEPT, 2 * cameras), 1 << 30, 64, 86_400)

    def store(self, camera: str) -> bytes:
        """The command that stores a report."""
        self._sent += 1
        keys = [f"{TAG}:{name}" for name in ("earlier", "cameras", "latest", "totals", "images", "senders")]
        places = (f"{TAG}:camera:", f"{TAG}:image:", camera, channel(camera), f"{TAG}:0:all")
        report = (self._sender, self._sent, "2026-11-23T03:00:00Z", 3, REPORT, "", "", len(REPORT) + 100)
        return command("EVALSHA", SHA, len(keys), *keys, *places, *report, *self._limits)

    def confirm(self) -> None:
        """Reads the reply of a stored report."""
        reply = self.connection.socket.recv(1 << 12)
        if reply != b"$-1\r\n":
            sys.exit(f"Redis has not stored a report: {reply!r}")


@contextlib.contextmanager
def redis() -> Iterator[int]:
    """A Redis that stores nothing on disk; its port."""
    with socket.socket() as free, tempfile.TemporaryDirectory() as folder:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
        free.close()
        options = ["--port", str(port), "--bind", "127.0.0.1", "--save", ""]
        process = subprocess.Popen(["redis-server", *options], cwd=folder, stdout=subprocess.DEVNULL)
        try:
            for _ in range(100):
                with contextlib.suppress(OSError):
                    Connection(port).ask("SCRIPT", "LOAD", SCRIPT)
                    break
                time.sleep(0.05)
            yield port
        finally:
            process.kill()
            process.wait()


def receive(port: int, subscriptions: list[list[str]], ready: multiprocessing.Event, received: object) -> None:
    """Receives the messages of all replicas, and counts them."""
    selector = selectors.DefaultSelector()
    for channels in subscriptions:
        connection = Connection(port)
        connection.ask("HELLO", 3)
        for name in channels:
            connection.ask("SSUBSCRIBE", name)
        selector.register(connection.socket, selectors.EVENT_READ, [b""])
    ready.set()
    while True:
        for key, _ in selector.select():
            text = key.data[0] + key.fileobj.recv(1 << 20)
            received.value += text.count(KIND)
            # The last bytes may be the beginning of the next one.
            key.data[0] = text[1 - len(KIND) :]


@contextlib.contextmanager
def listeners(port: int, subscriptions: list[list[str]]) -> Iterator[object]:
    """Subscribes each replica to its channels; the number of messages that they have received."""
    ready, received = multiprocessing.Event(), multiprocessing.Value("q", 0)
    process = multiprocessing.Process(target=receive, args=(port, subscriptions, ready, received), daemon=True)
    process.start()
    ready.wait()
    try:
        yield received
    finally:
        process.kill()
        process.join()


@dataclass
class Cost:
    """The CPU time of Redis, and what it did."""

    cpu_seconds: float
    seconds: float
    reports: int
    deliveries: float

    @property
    def milliseconds(self) -> float:
        """The CPU time of a report."""
        return 1000 * self.cpu_seconds / self.reports


@contextlib.contextmanager
def measured(port: int, reports: int, received: object) -> Iterator[Cost]:
    """Measures Redis in this block, in which it stores so many reports."""
    connection = Connection(port)
    cost = Cost(0.0, 0.0, reports, 0.0)
    received_before, began, before = received.value, time.monotonic(), connection.info()
    yield cost
    after, cost.seconds = connection.info(), time.monotonic() - began
    cost.cpu_seconds = sum(after[name] - before[name] for name in ("used_cpu_sys", "used_cpu_user"))
    # The receivers may be behind.
    time.sleep(0.5)
    cost.deliveries = (received.value - received_before) / reports


def one_by_one(count: int) -> Cost:
    """The cost with this number of replicas, for reports that arrive one by one."""
    cameras = [f"camera-{number}" for number in range(1000)]
    with redis() as port:
        replicas = [Replica(port, number, len(cameras)) for number in range(count)]
        subscriptions = [[channel(camera) for camera in cameras[number::count]] for number in range(count)]

        def store(number: int) -> None:
            # A frame may reach any replica, not only that of the listener.
            replica = replicas[(number * 7 + number // 1000) % count]
            replica.connection.socket.sendall(replica.store(cameras[number % len(cameras)]))
            replica.confirm()

        with listeners(port, subscriptions) as received:
            for number in range(KEPT + 1000):
                store(number)
            with measured(port, REPORTS, received) as cost:
                for number in range(REPORTS):
                    store(number)
            return cost


def at_once(count: int) -> Cost:
    """The cost of 10,000 cameras with a report per second, with this number of replicas."""
    cameras = [f"camera-{number}" for number in range(MANY_CAMERAS)]
    turns = round(MANY_CAMERAS * RATE_SECONDS / count)
    with redis() as port:
        replicas = [Replica(port, number, len(cameras)) for number in range(count)]
        listened = cameras[::10]
        subscriptions = [[channel(camera) for camera in listened[number::count]] for number in range(count)]

        def store(turn: int) -> None:
            for index, replica in enumerate(replicas):
                camera = cameras[(turn * count + index) % len(cameras)]
                replica.connection.socket.sendall(replica.store(camera))
            for replica in replicas:
                replica.confirm()

        with listeners(port, subscriptions) as received:
            for turn in range(3 * MANY_CAMERAS // count):
                store(turn)
            with measured(port, turns * count, received) as cost:
                began = time.monotonic()
                for turn in range(turns):
                    time.sleep(max(0.0, began + turn * count / MANY_CAMERAS - time.monotonic()))
                    store(turn)
            return cost


def main() -> None:
    """Prints the tables."""
    print("| replicas | deliveries per report | CPU time of Redis per report, ms |\n|---:|---:|---:|")
    for count in (1, 4, 16, 64):
        cost = one_by_one(count)
        print(f"| {count} | {cost.deliveries:.2f} | {cost.milliseconds:.3f} |", flush=True)
    cost = at_once(64)
    print(
        f"\n{MANY_CAMERAS:,} cameras, 64 replicas: {cost.reports / cost.seconds:,.0f} reports/s, "
        f"{cost.deliveries:.2f} deliveries per report, {cost.milliseconds:.3f} ms per report, "
        f"{cost.cpu_seconds / cost.seconds:.2f} cores of Redis"
    )


if __name__ == "__main__":
    main()
