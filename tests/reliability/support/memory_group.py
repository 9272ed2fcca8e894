"""A control group of Linux with a limit on memory (cgroups(7)), of version 2 or 1."""

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path("/sys/fs/cgroup")
NAME = f"lookdown-proof-{os.getpid()}"


@dataclass(frozen=True)
class MemoryGroup:
    """A control group for processes."""

    folder: Path
    files: dict[str, str]

    def inside(self) -> list[str]:
        """The command that runs another one inside the group."""
        return ["sh", "-c", f'echo $$ > "{self.folder}/cgroup.procs" && exec "$@"', "sh"]

    def peak_mib(self) -> float:
        """The peak memory use, page cache included."""
        return int((self.folder / self.files["peak"]).read_text(encoding="ascii")) / 2**20

    def kills(self) -> int:
        """The number of processes that were killed for lack of memory."""
        lines = (self.folder / self.files["events"]).read_text(encoding="ascii").splitlines()
        return next((int(line.split()[1]) for line in lines if line.startswith("oom_kill ")), 0)


VERSIONS = (
    (ROOT, {"limit": "memory.max", "peak": "memory.peak", "events": "memory.events"}),
    (
        ROOT / "memory",
        {"limit": "memory.limit_in_bytes", "peak": "memory.max_usage_in_bytes", "events": "memory.oom_control"},
    ),
)


@contextlib.contextmanager
def memory_group(mib: int) -> Iterator[MemoryGroup | None]:
    """A group with a limit while this is open. `None` if the machine does not permit it."""
    for root, files in VERSIONS:
        folder = root / NAME
        try:
            folder.mkdir()
        except OSError:
            continue
        try:
            if not (folder / files["limit"]).exists():
                continue
            (folder / files["limit"]).write_text(str(mib * 2**20), encoding="ascii")
            yield MemoryGroup(folder, files)
            return
        finally:
            with contextlib.suppress(OSError):
                folder.rmdir()
    yield None
