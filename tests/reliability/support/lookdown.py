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
    settings: dict[str, str],
    *,
    calibrations: Path = SAMPLES / "calibrations",
    inside: Sequence[str] = (),
    environment: dict[str, str] | None = None,
    port: int = 0,
) -> Iterator[Server]:
    """Starts a server, waits until it is ready, and stops it at the end.

    `inside` is a command that runs it in a separate environment, such as `prlimit`. `port` is that of a server
    before; without it, the port is a free one.
    """
    port = port or free_ports(1)[0]
    wanted = {"SERVER__LISTEN": f"127.0.0.1:{port}", "CALIBRATIONS__PATH": str(calibrations), **AT_ONCE, **settings}
    variables = {f"LOOKDOWN__{name}": value for name, value in wanted.items()} | (environment or {})
    with running("lookdown", [*inside, str(LOOKDOWN), "serve"], port, "/readyz", variables) as server:
        yield server


def is_root() -> bool:
    """Returns true if mounts and control groups are permitted."""
    return os.geteuid() == 0
