"""The resource usage of a process and its descendants, from /proc."""

import os
from dataclasses import dataclass
from pathlib import Path

PROC = Path("/proc")
TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Usage:
    """CPU time since the start, and memory now."""

    cpu_seconds: float
    resident_bytes: int


def usage_of(pid: int) -> Usage:
    """The usage of a process and its descendants. Pages that several of them share count for each."""
    stats = [_read(process) for process in _family(pid)]
    return Usage(
        sum(int(stat[11]) + int(stat[12]) for stat in stats) / TICKS_PER_SECOND,
        sum(int(stat[21]) for stat in stats) * PAGE_BYTES,
    )


def _family(pid: int) -> list[int]:
    children: dict[int, list[int]] = {}
    for folder in PROC.iterdir():
        if folder.name.isdigit() and (stat := _read(int(folder.name))):
            children.setdefault(int(stat[1]), []).append(int(folder.name))
    family = [pid]
    for member in family:
        family.extend(children.get(member, []))
    return [member for member in family if _read(member)]


def _read(pid: int) -> list[str]:
    """The fields of /proc/PID/stat from the state on (proc_pid_stat(5) counts it as the third)."""
    try:
        text = (PROC / str(pid) / "stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return []
    return text.rpartition(")")[2].split()
