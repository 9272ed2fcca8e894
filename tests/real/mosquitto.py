"""The MQTT broker of the tests, and its subscribers."""

import contextlib
import os
import signal
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from harness.processes import free_ports
from state import PATIENCE_SECONDS, wait_until

USER, PASSWORD = "lookdown", "s@cret/of:home"
PASSWORD_IN_URL = "s%40cret%2Fof%3Ahome"


@dataclass
class Broker:
    """A mosquitto that can be killed and restarted on the same port. It stores nothing on disk."""

    folder: Path
    tls: dict[str, Path] = field(default_factory=dict)
    port: int = field(default_factory=lambda: free_ports(1)[0])
    process: subprocess.Popen | None = None

    @property
    def url(self) -> str:
        """The setting `mqtt.url`."""
        scheme = "mqtts" if self.tls else "mqtt"
        return f"{scheme}://{USER}:{PASSWORD_IN_URL}@localhost:{self.port}"

    def start(self) -> None:
        """Starts it and waits until it answers."""
        passwords, config = self.folder / "passwords", self.folder / "mosquitto.conf"
        subprocess.run(["mosquitto_passwd", "-b", "-c", passwords, USER, PASSWORD], check=True, capture_output=True)
        lines = [f"listener {self.port} 127.0.0.1", "allow_anonymous false", f"password_file {passwords}"]
        lines += ["persistence false", "user root", *(f"{key} {path}" for key, path in self.tls.items())]
        config.write_text("\n".join(lines) + "\n", encoding="utf-8")
        self.process = subprocess.Popen(
            ["/usr/sbin/mosquitto", "-c", config], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        wait_until(lambda: self.client("pub", "-t", "test", "-n").returncode == 0, "mosquitto answers")

    def stop(self, signal_number: int = signal.SIGTERM) -> None:
        """Stops it."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.process.pid, signal_number)
        self.process.wait(timeout=PATIENCE_SECONDS)

    def client(self, which: str, *arguments: str) -> subprocess.CompletedProcess:
        """Runs `mosquitto_pub` or `mosquitto_sub` to its end."""
        command = [f"mosquitto_{which}", *self.login(), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_SECONDS)

    def login(self) -> list[str]:
        """The login options of mosquitto's clients."""
        authority = ["--cafile", str(self.tls["cafile"])] if self.tls else []
        return ["-h", "localhost", "-p", str(self.port), "-u", USER, "-P", PASSWORD, *authority]

    def retained(self) -> dict[str, str]:
        """All retained messages by topic."""
        said = self.client("sub", "-t", "#", "--retained-only", "-W", "1", "-F", "%t %p").stdout
        return dict(line.split(" ", 1) for line in said.splitlines())

    @contextlib.contextmanager
    def listening(self, topic: str) -> Iterator[list[str]]:
        """The messages published while this is open, one line with retained flag, topic and payload each."""
        said: list[str] = []
        with subprocess.Popen(
            ["mosquitto_sub", *self.login(), "-v", "-t", topic, "-t", "test/begin", "-F", "%r %t %p"],
            stdout=subprocess.PIPE,
            text=True,
        ) as process:
            os.set_blocking(process.stdout.fileno(), False)

            def hear() -> list[str]:
                with contextlib.suppress(TypeError):
                    said.extend(line.rstrip("\n") for line in process.stdout)
                return said

            def begun() -> bool:
                self.client("pub", "-t", "test/begin", "-n")
                return any("test/begin" in line for line in hear())

            wait_until(begun, "the subscriber receives")
            said.clear()
            try:
                yield Heard(hear)
            finally:
                process.terminate()


class Heard:
    """Lines that are received during a test."""

    def __init__(self, hear):
        self.hear = hear

    def of(self, topic: str) -> list[str]:
        """The payloads of a topic."""
        lines = (line.split(" ", 2) for line in self.hear())
        return [payload for _, said, payload in lines if said == topic]


@contextlib.contextmanager
def broker(folder: Path, tls: dict[str, Path] | None = None) -> Iterator[Broker]:
    """A broker that answers, and is stopped at the end."""
    started = Broker(folder, tls or {})
    started.start()
    try:
        yield started
    finally:
        started.stop()
