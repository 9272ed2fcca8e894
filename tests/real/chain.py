"""Replicas of Lookdown on separate hosts behind HAProxy, with a shared Redis and a shared folder of calibrations."""

import contextlib
import hashlib
import socket
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from harness.places import LOOKDOWN, ROOT
from harness.processes import Server, running
from hosts import Host, hosts
from redis_server import RedisServer
from state import wait_until
from support.control_group import cpu_share

REPLICAS = ("r1", "r2", "r3")
RECIPE = ROOT / "docker" / "haproxy.cfg"
"""The recipe of the documentation: the frames of a camera reach one replica."""
PORT = 8080
GRACE_MILLIS = 2000
KEY = "of-the-test"
KEYS = f"test:admin:{hashlib.sha256(KEY.encode()).hexdigest()}"
LEASTCONN = """
defaults
    mode http
    timeout connect 1s
    timeout client 30s
    timeout server 5s
    timeout check 1s
    # A request is sent to another replica only if this one cannot have seen it.
    retries 3
    retry-on conn-failure
    option redispatch 1
frontend front
    bind :8080
    monitor-uri /proxy-health
    default_backend replicas
backend replicas
    balance leastconn
    option httpchk GET /readyz
    http-response set-header X-Replica %s
    default-server check inter 250ms fall 2 rise 2
    server r1 lookdown-1:8080
    server r2 lookdown-2:8080
    server r3 lookdown-3:8080
"""
CONTROL = """
global
    stats socket {socket} mode 600 level admin
"""


class Chain:
    """All processes."""

    def __init__(
        self,
        machines: dict[str, Host],
        folder: Path,
        settings: dict[str, str],
        cores: float | None,
        front: str,
    ):
        self._machines, self._folder, self._settings, self._cores = machines, folder, settings, cores
        self._front = front
        self._calibrations = folder / "calibrations"
        self._stacks: dict[str, contextlib.ExitStack] = {}
        self.replicas: dict[str, Server] = {}
        self.front: Server
        self._redis: RedisServer

    def host(self, name: str) -> Host:
        """The host of a replica."""
        return self._machines[name]

    def start(self, name: str) -> None:
        """Starts a replica and waits until it is ready. A previous one has ended or is stopped."""
        self.end(name)
        stack = self._stacks[name] = contextlib.ExitStack()
        host = self._machines[name]
        variables = {f"LOOKDOWN__{key}": value for key, value in self._settings.items()} | {
            "LOOKDOWN__SERVER__LISTEN": f"0.0.0.0:{PORT}",
            "LOOKDOWN__SHUTDOWN__GRACE_MILLIS": str(GRACE_MILLIS),
            "LOOKDOWN__ACCESS__KEYS": KEYS,
            "LOOKDOWN__CALIBRATIONS__PATH": str(self._calibrations),
            "LOOKDOWN__CALIBRATIONS__POLL_SECONDS": "1",
            "LOOKDOWN__RESULTS__URL": self._redis.url,
        }
        inside = host.inside
        if self._cores:
            inside = [*stack.enter_context(cpu_share(name, self._cores)), *inside]
        command = [*inside, str(LOOKDOWN), "serve"]
        self.replicas[name] = stack.enter_context(
            running(f"replica-{name}", command, PORT, "/readyz", variables, host=host.address)
        )

    def kill(self, name: str) -> float:
        """Kills a replica. Returns the time, on the clock of `time.monotonic`, from which on it accepts no connection.

        The kernel accepts connections for a process that is killed until it has freed the memory of it.
        """
        process = self.replicas[name].process
        process.kill()
        process.wait(timeout=30)
        return time.monotonic()

    def end(self, name: str) -> None:
        """Stops a replica and what is left of it."""
        if name in self._stacks:
            self._stacks.pop(name).close()

    def serve_with(self, count: int) -> None:
        """Lets only this number of replicas get requests."""
        for number, name in enumerate(REPLICAS):
            self._command_front(f"set server replicas/{name} state {'ready' if number < count else 'maint'}")

    def wait_until(self, name: str, state: str) -> None:
        """Waits until HAProxy regards a replica as `UP` or `DOWN`."""
        wait_until(lambda: self._states()[name] == state, f"the front takes {name} for {state}")

    def _states(self) -> dict[str, str]:
        rows = [line.split(",") for line in self._command_front("show stat").splitlines()]
        return {row[1]: row[17].split()[0] for row in rows if row[0] == "replicas"}

    def _command_front(self, command: str) -> str:
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(str(self._folder / "front.socket"))
            connection.sendall(f"{command}\n".encode())
            return connection.makefile(encoding="utf-8").read()

    def start_shared_parts(self, stack: contextlib.ExitStack) -> None:
        """Starts what the replicas need, and HAProxy in front of them."""
        store, front = self._machines["store"], self._machines["front"]
        self._redis = stack.enter_context(RedisServer(host=store.address, inside=store.inside))
        self._calibrations.mkdir()
        listing = self._front
        for number, name in enumerate(REPLICAS, 1):
            listing = listing.replace(f"lookdown-{number}:", f"{self._machines[name].address}:")
        plan = self._folder / "haproxy.cfg"
        plan.write_text(listing + CONTROL.format(socket=self._folder / "front.socket"), encoding="utf-8")
        command = [*front.inside, "haproxy", "-db", "-f", str(plan)]
        self.front = stack.enter_context(running("front", command, PORT, "/proxy-health", {}, host=front.address))


@contextlib.contextmanager
def chain(settings: dict[str, str], cores: float | None = None, front: str = LEASTCONN) -> Iterator[Chain]:
    """Starts three replicas with these settings, each with this number of cores, or all with those of the machine.

    `front` is the configuration of HAProxy.
    """
    with (
        tempfile.TemporaryDirectory() as folder,
        hosts("store", "front", *REPLICAS) as machines,
        contextlib.ExitStack() as stack,
    ):
        made = Chain(machines, Path(folder), settings, cores, front)
        made.start_shared_parts(stack)
        for name in REPLICAS:
            stack.callback(made.end, name)
            made.start(name)
        for name in REPLICAS:
            made.wait_until(name, "UP")
        yield made
