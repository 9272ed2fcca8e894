"""The resources of a process, from /proc, and their growth."""

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

MIB = 2**20
PAGE_BYTES = 4096


@dataclass(frozen=True)
class Holdings:
    """The resources at one moment."""

    resident_mib: float
    threads: int
    descriptors: int


def holdings(pid: int) -> Holdings:
    """The current resources of a process."""
    folder = Path("/proc") / str(pid)
    status = dict(line.split(":", 1) for line in (folder / "status").read_text(encoding="utf-8").splitlines())
    resident = int(status["VmRSS"].split()[0]) / 1024
    return Holdings(resident, int(status["Threads"]), sum(1 for _ in (folder / "fd").iterdir()))


class Watch:
    """Samples a process at intervals while it is open."""

    def __init__(self, pid: int, every_seconds: float):
        self.samples: list[tuple[float, Holdings]] = []
        self._pid, self._every = pid, every_seconds
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._look)

    def __enter__(self) -> "Watch":
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._ended.set()
        self._thread.join()

    def _look(self) -> None:
        began = time.monotonic()
        while not self._ended.wait(self._every):
            self.samples.append((time.monotonic() - began, holdings(self._pid)))

    def peak_resident_mib(self) -> float:
        """The maximum of the sampled memory."""
        return max(seen.resident_mib for _, seen in self.samples)


def growth(points: Sequence[tuple[float, float]]) -> float:
    """The rise of the regression line (least squares) from the first to the last point."""
    count = len(points)
    mean_x, mean_y = (sum(point[axis] for point in points) / count for axis in (0, 1))
    spread = sum((x - mean_x) ** 2 for x, _ in points)
    slope = sum((x - mean_x) * (y - mean_y) for x, y in points) / spread if spread else 0.0
    return slope * (points[-1][0] - points[0][0])
