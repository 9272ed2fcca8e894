"""Boots the Debian in a folder with its own systemd, in a container that shares this machine's network."""

import contextlib
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from commands import run
from waiting import wait_until

BOOT_SECONDS = 120.0


@dataclass(frozen=True)
class Booted:
    """A running system."""

    process: subprocess.Popen

    def run(self, *command: str) -> str:
        """Returns the output of a command that must succeed."""
        return run("nsenter", f"--target={self._first_process()}", "--all", *command, seconds=120).strip()

    def show(self, unit: str, name: str) -> str:
        """A property of a unit, by its name in `systemctl show`."""
        return self.run("systemctl", "show", "--value", f"--property={name}", unit)

    def _first_process(self) -> int:
        """The process that has the number 1 inside."""
        processes = [line.split() for line in run("ps", "-eo", "pid=,ppid=,comm=").splitlines()]
        # systemd-nspawn has a child that becomes the systemd inside.
        return next(
            int(pid) for pid, parent, name, *_ in processes if (int(parent), name) == (self.process.pid, "systemd")
        )


@contextlib.contextmanager
def booted(root: Path, log: Path) -> Iterator[Booted]:
    """Boots, and powers off at the end. The console is written to `log`."""
    command = ["systemd-nspawn", "--register=no", "--keep-unit", "--console=pipe", f"--directory={root}", "--boot"]
    with (
        log.open("wb") as console,
        subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=console, stderr=subprocess.STDOUT) as process,
    ):
        system = Booted(process)
        try:
            wait_until(lambda: _has_booted(system), "the system has booted", BOOT_SECONDS)
            yield system
        finally:
            process.terminate()
            process.wait(60)


def _has_booted(system: Booted) -> bool:
    if system.process.poll() is not None:
        raise AssertionError("the system ended while it booted")
    # At first there is no systemd inside, or it does not answer yet.
    with contextlib.suppress(StopIteration, AssertionError):
        return system.show("multi-user.target", "ActiveState") == "active"
    return False
