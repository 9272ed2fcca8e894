"""The folders of the set-up, all inside the repository."""

import contextlib
import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from .console import SetupError, say


@dataclass(frozen=True)
class Places:
    """The repository and the set-up's own folder in it."""

    root: Path

    @property
    def own(self) -> Path:
        """Archives, the private Python and unfinished work."""
        return self.root / ".setup"

    @property
    def downloads(self) -> Path:
        """Archives that were fetched and checked."""
        return self.own / "downloads"

    @property
    def python(self) -> Path:
        """The private Python environment."""
        return self.own / "venv"

    @property
    def bench_pythons(self) -> Path:
        """The Python environments of the benchmarks, a folder each."""
        return self.own / "benches"

    @contextlib.contextmanager
    def temporary(self) -> Iterator[Path]:
        """A temporary folder for unfinished work, on the same file system as the results."""
        parent = self.own / "unfinished"
        parent.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(dir=parent))
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Locks the set-up, and removes unfinished work of a killed one."""
        self.own.mkdir(parents=True, exist_ok=True)
        with open(self.own / "lock", "w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                say("set-up", "waiting for another set-up of this folder to finish")
                fcntl.flock(lock, fcntl.LOCK_EX)
            shutil.rmtree(self.own / "unfinished", ignore_errors=True)
            yield


def put_in_place(finished: Path, destination: Path) -> None:
    """Renames a finished file in one step, so that no reader sees an incomplete one."""
    destination.parent.mkdir(parents=True, exist_ok=True)
    os.replace(finished, destination)


def require_space(folder: Path, needed: int) -> None:
    """Raises an error if the free space is too small."""
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise SetupError(
            f"The set-up needs {needed // 1_000_000} MB of free space in {folder} "
            f"and there are {free // 1_000_000} MB; free some and run the set-up again."
        )
