"""Runs another program with progress by its written bytes, and prints its last output if it fails."""

import os
import subprocess
import sys
import time
from pathlib import Path

from .console import SetupError, megabytes, say

LAST_WORDS = 16
WORTH_SAYING = 100_000
SECONDS_BETWEEN_LINES = 5.0
SECONDS_BETWEEN_REDRAWS = 0.25


def run(
    step: str, command: list[str], *, folder: Path, environment: dict[str, str], failure: str, size: int = 0
) -> None:
    """Runs `command` in `folder`, with its temporary files there too, and reports how those files grow.

    `size` is how many bytes are to come, if known. When the command fails, `failure` and the end of its output
    become the error.
    """
    scratch = folder / "scratch"
    scratch.mkdir()
    log = folder / "output.log"
    environment = environment | {"TMPDIR": str(scratch)}
    with open(log, "wb") as output:
        try:
            process = subprocess.Popen(
                command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT
            )
        except OSError as error:
            raise SetupError(f"{failure}\n  {command[0]}: {error.strerror}") from None
        try:
            _watch(step, process, folder, size)
        finally:
            if process.poll() is None:
                process.terminate()
                process.wait()
    if process.returncode != 0:
        lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-LAST_WORDS:]
        raise SetupError("\n".join([failure, *(f"  {line}" for line in lines)]))


def _watch(step: str, process: subprocess.Popen, folder: Path, size: int) -> None:
    """Waits for the process; redraws one line on a terminal, prints a line now and then elsewhere."""
    redraws = sys.stdout.isatty()
    interval = SECONDS_BETWEEN_REDRAWS if redraws else SECONDS_BETWEEN_LINES
    shown = time.monotonic()
    while True:
        try:
            process.wait(timeout=0.1)
            break
        except subprocess.TimeoutExpired:
            pass
        if time.monotonic() - shown >= interval:
            shown = time.monotonic()
            _show(step, _bytes_in(folder), size, redraws)
    if redraws:
        print("\r\033[K", end="", flush=True)


def _show(step: str, received: int, size: int, redraws: bool) -> None:
    if size:
        # Clients copy what they have fetched before they finish, so the folder may briefly hold it twice.
        text = f"  {megabytes(min(received, size))} of {megabytes(size)}"
    else:
        text = "  still at work" + (f" ({megabytes(received)} so far)" if received > WORTH_SAYING else "")
    if redraws:
        print(f"\r\033[K{step:<10} {text}", end="", flush=True)
    else:
        say(step, text)


def _bytes_in(folder: Path) -> int:
    total = 0
    for parent, _, files in os.walk(folder):
        for file in files:
            try:
                total += os.lstat(os.path.join(parent, file)).st_size
            except FileNotFoundError:
                continue  # the command has just moved or deleted it
    return total
