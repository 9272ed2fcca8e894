"""Runs programs that must succeed."""

import subprocess
from pathlib import Path

from harness.places import ROOT

SHOWN = 3000
"""Characters of each output in the message of a failure."""


class CommandFailed(AssertionError):
    """A program has failed. The message has its output."""


def run(
    *command: object,
    given: str | None = None,
    cwd: Path = ROOT,
    environment: dict[str, str] | None = None,
    seconds: float = 600.0,
) -> str:
    """Returns the output of a program. It reads `given`; `environment` replaces that of this process."""
    words = list(map(str, command))
    options = {"capture_output": True, "text": True, "check": False, "timeout": seconds}
    done = subprocess.run(words, input=given, cwd=cwd, env=environment, **options)
    if done.returncode:
        raise CommandFailed(f"{' '.join(words)}:\n{done.stdout[-SHOWN:]}{done.stderr[-SHOWN:]}")
    return done.stdout
