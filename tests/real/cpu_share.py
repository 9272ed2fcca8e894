"""A Linux control group with a limit on CPU time (cgroups(7)), version 2 or 1: a machine of a chosen size."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

ROOT = Path("/sys/fs/cgroup")
PERIOD_MICROS = 20_000
"""Short, so that the time of a frame does not come in steps of a tenth of a second."""
VERSIONS = (
    (ROOT, {"cpu.max": "{quota} {period}"}),
    (ROOT / "cpu", {"cpu.cfs_period_us": "{period}", "cpu.cfs_quota_us": "{quota}"}),
)


@contextlib.contextmanager
def cpu_share(name: str, cores: float) -> Iterator[list[str]]:
    """The command that runs another one with this number of cores, while this is open."""
    for root, files in VERSIONS:
        folder = root / f"lookdown-{os.getpid()}-{name}"
        try:
            folder.mkdir()
        except OSError:
            continue
        try:
            if not all((folder / file).exists() for file in files):
                continue
            for file, value in files.items():
                limits = {"quota": round(cores * PERIOD_MICROS), "period": PERIOD_MICROS}
                (folder / file).write_text(value.format(**limits), encoding="ascii")
            yield ["sh", "-c", f'echo $$ > "{folder}/cgroup.procs" && exec "$@"', "sh"]
            return
        finally:
            with contextlib.suppress(OSError):
                folder.rmdir()
    raise OSError("this machine permits no control group for CPU time")
