"""Starts servers, waits until they are ready, and stops them."""

import contextlib
import os
import random
import signal
import socket
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from .places import ROOT, WORK
from .usage import Usage, usage_of

LAST_WORDS = 15
PORTS = (12_000, 32_000)
STOP_SECONDS = 20.0


class BenchError(Exception):
    """An error that stops a benchmark."""


@dataclass(frozen=True)
class Server:
    """A running server."""

    address: str
    process: subprocess.Popen
    seconds_to_ready: float
    log: Path
    """What it prints; removed after a use without an error."""

    @property
    def pid(self) -> int:
        """The ID of the first process."""
        return self.process.pid

    def usage(self) -> Usage:
        """The resource usage of the server and its workers."""
        return usage_of(self.pid)

    def get(self, path: str) -> bytes:
        """Returns the body at a path."""
        with urllib.request.urlopen(f"http://{self.address}{path}", timeout=60) as answer:
            return answer.read()

    def wait_for(self, path: str, seconds: float = 60.0) -> None:
        """Waits until a path returns success."""
        deadline = time.monotonic() + seconds
        while True:
            try:
                self.get(path)
                return
            except urllib.error.HTTPError as error:
                if time.monotonic() > deadline:
                    raise BenchError(f"{path} is still answered {error.code} after {seconds:.0f} s") from None
            time.sleep(0.05)

    def delete(self, path: str) -> int:
        """Returns the status of a deletion."""
        request = urllib.request.Request(f"http://{self.address}{path}", method="DELETE")
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status

    def post(self, path: str, body: bytes, content_type: str = "image/jpeg") -> bytes:
        """Returns the response to a body."""
        headers = {"Content-Type": content_type}
        request = urllib.request.Request(f"http://{self.address}{path}", body, headers)
        try:
            with urllib.request.urlopen(request, timeout=600) as answer:
                return answer.read()
        except urllib.error.HTTPError as error:
            raise BenchError(f"{path} was answered {error.code}: {error.read(2000).decode(errors='replace')}") from None


def free_ports(count: int) -> list[int]:
    """Returns unused ports.

    They are drawn at random below those that the system gives to connections, so that tests that run at the same time
    hardly ever get the same one.
    """
    found: list[int] = []
    while len(found) < count:
        port = random.randrange(*PORTS)
        with socket.socket() as tried, contextlib.suppress(OSError):
            tried.bind(("127.0.0.1", port))
            found += [port] if port not in found else []
    return found


@contextlib.contextmanager
def running(
    name: str,
    command: list[str],
    port: int,
    ready: str,
    environment: dict[str, str],
    folder: Path = ROOT,
    host: str = "127.0.0.1",
) -> Iterator[Server]:
    """Starts a server on `port` of `host` and waits until `ready` returns 200."""
    WORK.mkdir(parents=True, exist_ok=True)
    log = WORK / f"{name}-{port}.log"
    started = time.monotonic()
    with open(log, "wb") as output:
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=os.environ | environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            address = f"{host}:{port}"
            _wait(process, f"http://{address}{ready}", name, log)
            yield Server(address, process, time.monotonic() - started, log)
        finally:
            _stop(process)
    log.unlink(missing_ok=True)


def _wait(process: subprocess.Popen, url: str, name: str, log: Path, seconds: float = 90.0) -> None:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        with contextlib.suppress(OSError), urllib.request.urlopen(url, timeout=5) as answer:
            if answer.status == 200:
                return
        with contextlib.suppress(subprocess.TimeoutExpired):
            status = process.wait(timeout=0.005)
            raise BenchError("\n".join([f"{name} ended with status {status}. It said:", *_last_words(log)]))
    raise BenchError("\n".join([f"{name} did not get ready within {seconds:.0f} s. It said:", *_last_words(log)]))


def _last_words(log: Path) -> list[str]:
    return log.read_text(encoding="utf-8", errors="replace").splitlines()[-LAST_WORDS:]


def _stop(process: subprocess.Popen) -> None:
    """Ends the server and its child processes, which share its session."""
    for signal_number in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal_number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=STOP_SECONDS)
            break
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
