"""Where the set-up keeps things; every path is inside the repository."""

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
        """A folder for unfinished work, on the same file system as the results, gone afterwards."""
        parent = self.own / "unfinished"
        parent.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(dir=parent))
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Lets one set-up at a time work here, and clears away what a killed one left unfinished."""
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
    """Moves a finished file to its name in one step, so that no reader ever sees half of it."""
    destination.parent.mkdir(parents=True, exist_ok=True)
    os.replace(finished, destination)


def require_space(folder: Path, needed: int) -> None:
    """Refuses to begin what cannot fit."""
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise SetupError(
            f"The set-up needs {needed // 1_000_000} MB of free space in {folder} "
            f"and there are {free // 1_000_000} MB; free some and run the set-up again."
        )
