"""Starts the release binary for the proofs."""

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from harness.places import LOOKDOWN
from harness.processes import Server, free_ports, running

from .places import SAMPLES, TINY_MODEL

DETECT = "/detect?calibration=office&profile=fast"
AT_ONCE = {"SHUTDOWN__GRACE_MILLIS": "0"}
"""Stops without a grace period."""
TINY = {"MODEL__PATH": str(TINY_MODEL)}
"""Settings of a server whose network takes no time."""


@contextlib.contextmanager
def lookdown(
    settings: dict[str, object],
    *,
    command: Sequence[object] = ("serve",),
    probe: str = "/readyz",
    calibrations: Path = SAMPLES / "calibrations",
    inside: Sequence[str] = (),
) -> Iterator[Server]:
    """Starts a server, waits until its probe answers, and stops it at the end. `command` may be that of `run`.

    `inside` is a command that runs it in a separate environment, such as `prlimit`.
    """
    (port,) = free_ports(1)
    wanted = {"SERVER__LISTEN": f"127.0.0.1:{port}", "CALIBRATIONS__PATH": str(calibrations), **AT_ONCE, **settings}
    variables = {f"LOOKDOWN__{name}": str(value) for name, value in wanted.items()}
    words = [*inside, str(LOOKDOWN), *map(str, command)]
    with running("lookdown", words, port, probe, variables) as server:
        yield server


def is_root() -> bool:
    """Returns true if mounts and control groups are permitted."""
    return os.geteuid() == 0
