"""A minimal Debian in a folder: the base of the image, and where packages are installed, used, booted and purged."""

import contextlib
import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from commands import run
from harness.places import ROOT
from state import wait_until

RELEASE = "bookworm"
PLACE = ROOT / ".setup" / "real"
UNITS = "usr/lib/systemd/system"
UNIT = f"{UNITS}/lookdown.service"
WITH_PROC = 'mount --bind /proc "$1/proc" && exec chroot "$@"'
OWN_RECORDS = ("proc/", "sys/", "dev/", "tmp/", "var/cache/", "var/log/", "var/lib/apt/", "var/lib/dpkg/")
"""The records that Debian keeps of every installation."""
BOOT_SECONDS = 120.0


def debian_base(*packages: str) -> Path:
    """Returns the folder of a minimal Debian with these packages, which `debootstrap` creates on the first call."""
    place = PLACE / "-".join(["debian", *packages])
    if not place.is_dir():
        unfinished = place.with_name(f"{place.name}.unfinished")
        shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.parent.mkdir(parents=True, exist_ok=True)
        more = [f"--include={','.join(packages)}"] if packages else []
        run("debootstrap", "--variant=minbase", *more, RELEASE, unfinished, seconds=3600)
        for package in (unfinished / "var" / "cache" / "apt" / "archives").glob("*.deb"):
            package.unlink()
        unfinished.rename(place)
    return place


@dataclass(frozen=True)
class Chroot:
    """A copy of a minimal Debian with systemd."""

    root: Path

    @classmethod
    def create(cls, root: Path) -> "Chroot":
        """Copies the base."""
        subprocess.run(["cp", "--archive", "--reflink=auto", debian_base("systemd-sysv"), root], check=True)
        return cls(root)

    def run(self, *command: str | Path) -> str:
        """Returns the output of a command that must succeed."""
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive", "LC_ALL": "C"}
        isolated = ["/usr/bin/unshare", "--mount", "/bin/sh", "-c", WITH_PROC, "sh", self.root]
        return run(*isolated, *command, environment=environment)

    def install(self, package: Path) -> None:
        """Installs a package file. The base has all of its dependencies."""
        shutil.copy(package, self.root / "tmp")
        self.run("dpkg", "--install", f"/tmp/{package.name}")

    def files(self) -> dict[str, bytes | None]:
        """All files with the content of those in /etc, except the records of the installation."""
        found = {}
        for folder, folders, names in os.walk(self.root):
            for name in [*folders, *names]:
                path = Path(folder, name)
                place = str(path.relative_to(self.root))
                if not place.startswith(OWN_RECORDS):
                    is_text = place.startswith("etc/") and path.is_file() and not path.is_symlink()
                    found[place] = path.read_bytes() if is_text else None
        return found

    def has(self, path: str) -> bool:
        """`True` if the path exists, even as a dangling link."""
        return os.path.lexists(self.root / path)


@dataclass(frozen=True)
class Booted:
    """A running system of such a folder, in a container that shares this machine's network."""

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
