"""The set-up with all its steps and errors."""

import contextlib
import errno
import fcntl
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

from .console import SetupError, say
from .environments import FAMILIES, STEPS, install_step
from .machine import check_toolchain, supported_cpu
from .runtime import install_runtime, pinned_runtime, require_loadable
from .ssdlite import install_ssdlite

ROOT = Path(__file__).resolve().parents[3]
BUILD = ("toolchain", "runtime")
KNOWN = (*BUILD, "models", *STEPS, *FAMILIES)


def main(arguments: list[str]) -> int:
    """Runs the named steps, those of a build by default; the exit status is 0 only if everything is in place."""
    signal.signal(signal.SIGTERM, _stop)
    unknown = [name for name in arguments if name not in KNOWN]
    if unknown:
        print(f"There is no step '{unknown[0]}'; the steps are {', '.join(KNOWN)}.", file=sys.stderr)
        return 2
    try:
        _set_up(ROOT, arguments or list(BUILD))
    except SetupError as error:
        print(f"\nThe set-up stopped. {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"\nThe set-up stopped. {_explain(error)}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nInterrupted. What was finished is kept; run the set-up again to go on.", file=sys.stderr)
        return 130
    return 0


def _set_up(root: Path, steps: list[str]) -> None:
    cpu = supported_cpu()
    if "toolchain" in steps:
        check_toolchain(root)
    with locked(root / ".setup"):
        if "runtime" in steps:
            install_runtime(pinned_runtime(cpu), root / "runtime", root / ".setup" / "downloads")
            require_loadable(root / "runtime")
        for step in steps:
            if step in STEPS or step in FAMILIES:
                install_step(root, step)
        if "models" in steps:
            install_ssdlite(root)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Locks the set-up of this repository."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "lock", "w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say("set-up", "waiting for another set-up of this folder to finish")
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _explain(error: OSError) -> str:
    place = error.filename or ROOT
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"There is no space left for {place}; free some and run the set-up again; it continues where it stopped."
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"{place} cannot be written by this user; use a clone in a folder of your own, or make this one yours."
    return f"{error.strerror or error}: {place}"


def _stop(_signal, _frame) -> None:
    raise KeyboardInterrupt
