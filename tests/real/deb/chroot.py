"""A Debian in a folder, in which packages are installed, used and purged."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from commands import run
from debian_base import debian_base

UNITS = "usr/lib/systemd/system"
UNIT = f"{UNITS}/lookdown.service"
WITH_PROC = 'mount --bind /proc "$1/proc" && exec chroot "$@"'
OWN_RECORDS = ("proc/", "sys/", "dev/", "tmp/", "var/cache/", "var/log/", "var/lib/apt/", "var/lib/dpkg/")
"""The records that Debian keeps of every installation."""


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
