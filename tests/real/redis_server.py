"""A Redis for tests: it can be started, killed, halted and queried."""

import contextlib
import shutil
import signal
import socket
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from harness.processes import free_ports
from state import wait_until


class RedisServer:
    """A `redis-server` that stores nothing on disk."""

    def __init__(self, *options: str, password: str = "", host: str = "127.0.0.1", inside: Sequence[str] = ()) -> None:
        """`options` are command-line options; the connection of this test sends `password`.

        `host` is its address, and the command `inside` starts a program on the host with that address.
        """
        (self.port,) = free_ports(1)
        self.host, self.password = host, password
        self._inside = inside
        self._options = options
        self._folder = Path(tempfile.mkdtemp(prefix="lookdown-redis-"))
        self._process: subprocess.Popen | None = None

    def __enter__(self) -> "RedisServer":
        """Starts it."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Kills it."""
        self.kill()
        shutil.rmtree(self._folder)

    @property
    def url(self) -> str:
        """The value for `results.url`."""
        secret = f":{self.password}@" if self.password else ""
        return f"redis://{secret}{self.host}:{self.port}/0"

    def start(self) -> None:
        """Starts it and waits until it answers."""
        place = ["--port", str(self.port), "--bind", self.host, "--protected-mode", "no"]
        command = [*self._inside, "redis-server", *place, "--save", "", *self._options]
        self._process = subprocess.Popen(command, cwd=self._folder, stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT)
        wait_until(self._answers, "redis-server answers")

    def _answers(self) -> bool:
        with contextlib.suppress(OSError, RedisError):
            return bool(self.ask("PING"))
        return False

    def kill(self) -> None:
        """Kills it at once: its data are lost."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def halt(self) -> None:
        """Halts it: its connections stay open, but it does not answer."""
        self._process.send_signal(signal.SIGSTOP)

    def go_on(self) -> None:
        """Continues after `halt`."""
        self._process.send_signal(signal.SIGCONT)

    def ask(self, *words: object):
        """The answer to one command."""
        return self.ask_all([words])[0]

    def ask_all(self, commands: list[tuple]) -> list:
        """The answers to commands, in order."""
        if self.password:
            commands = [("AUTH", self.password), *commands]
        with socket.create_connection((self.host, self.port), 10.0) as connection, connection.makefile("rb") as answers:
            connection.sendall(b"".join(_command(words) for words in commands))
            told = [_answer(answers) for _ in commands]
        for answer in told:
            if isinstance(answer, RedisError):
                raise answer
        return told[1:] if self.password else told


class RedisError(Exception):
    """A refusal of Redis, with its reason."""


def _command(words: tuple) -> bytes:
    """A command as bytes (RESP)."""
    parts = [word if isinstance(word, bytes) else str(word).encode() for word in words]
    lengths = b"".join(b"$%d\r\n%s\r\n" % (len(part), part) for part in parts)
    return b"*%d\r\n%s" % (len(parts), lengths)


def _answer(stream):
    line = stream.readline()
    if not line:
        raise ConnectionError("Redis has closed the connection")
    kind, rest = line[:1], line[1:-2]
    if kind == b"+":
        return rest.decode()
    if kind == b"-":
        return RedisError(rest.decode())
    if kind == b":":
        return int(rest)
    if kind == b"$":
        return None if rest == b"-1" else stream.read(int(rest) + 2)[:-2]
    return None if rest == b"-1" else [_answer(stream) for _ in range(int(rest))]
