"""Control groups of Linux (cgroups(7)), of version 2 or 1, with a limit on memory or on CPU time."""

import contextlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path("/sys/fs/cgroup")
PERIOD_MICROS = 20_000
"""Of CPU time. Short, so that the time of a frame does not come in steps of a tenth of a second."""


@dataclass(frozen=True)
class ControlGroup:
    """A control group for processes."""

    folder: Path

    def inside(self) -> list[str]:
        """The command that runs another one inside the group."""
        return ["sh", "-c", f'echo $$ > "{self.folder}/cgroup.procs" && exec "$@"', "sh"]

    def _first(self, *names: str) -> str:
        """The content of the file that this version has."""
        return next((self.folder / name).read_text(encoding="ascii") for name in names if (self.folder / name).exists())

    def peak_mib(self) -> float:
        """The peak memory use, page cache included."""
        return int(self._first("memory.peak", "memory.max_usage_in_bytes")) / 2**20

    def kills(self) -> int:
        """The number of processes that were killed for lack of memory."""
        lines = self._first("memory.events", "memory.oom_control").splitlines()
        return next((int(line.split()[1]) for line in lines if line.startswith("oom_kill ")), 0)


@contextlib.contextmanager
def _control_group(name: str, versions: Sequence[tuple[Path, dict[str, str]]]) -> Iterator[ControlGroup | None]:
    """A group while this is open, by the first version whose files are there. `None` if the machine permits none."""
    for root, limits in versions:
        folder = root / f"lookdown-{os.getpid()}-{name}"
        try:
            folder.mkdir()
        except OSError:
            continue
        try:
            if not all((folder / file).exists() for file in limits):
                continue
            for file, value in limits.items():
                (folder / file).write_text(value, encoding="ascii")
            yield ControlGroup(folder)
            return
        finally:
            with contextlib.suppress(OSError):
                folder.rmdir()
    yield None


@contextlib.contextmanager
def memory_group(mib: int) -> Iterator[ControlGroup | None]:
    """A group with a limit on memory. `None` if the machine does not permit it."""
    limit = str(mib * 2**20)
    versions = ((ROOT, {"memory.max": limit}), (ROOT / "memory", {"memory.limit_in_bytes": limit}))
    with _control_group("memory", versions) as group:
        yield group


@contextlib.contextmanager
def cpu_share(name: str, cores: float) -> Iterator[list[str]]:
    """The command that runs another one with this number of cores: a machine of a chosen size."""
    quota, period = str(round(cores * PERIOD_MICROS)), str(PERIOD_MICROS)
    versions = (
        (ROOT, {"cpu.max": f"{quota} {period}"}),
        (ROOT / "cpu", {"cpu.cfs_period_us": period, "cpu.cfs_quota_us": quota}),
    )
    with _control_group(name, versions) as group:
        if group is None:
            raise OSError("this machine permits no control group for CPU time")
        yield group.inside()
