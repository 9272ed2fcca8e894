"""The set-up from start to end, and every way in which it stops."""

import errno
import signal
import sys
import time
from pathlib import Path

from .console import SetupError, say
from .machine import supported_cpu
from .pins import read_pins
from .places import Places
from .steps import install_model, install_runtime
from .toolchain import check_toolchain

ROOT = Path(__file__).resolve().parents[2]
STEPS = ("toolchain", "runtime", "model")


def main(arguments: list[str]) -> int:
    """Runs the named steps, all by default; the exit status is 0 only if everything is in place."""
    unknown = [name for name in arguments if name not in STEPS]
    if unknown:
        print(f"There is no step '{unknown[0]}'; the steps are {', '.join(STEPS)}.", file=sys.stderr)
        return 2
    signal.signal(signal.SIGTERM, _stop)
    try:
        _set_up(Places(ROOT), arguments or list(STEPS))
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


def _set_up(places: Places, steps: list[str]) -> None:
    started = time.monotonic()
    pins = read_pins(places.root / "scripts" / "pins.toml")
    cpu = supported_cpu()
    if "toolchain" in steps:
        check_toolchain(places.root)
    with places.locked():
        if "runtime" in steps:
            install_runtime(places, pins.runtime[cpu])
        if "model" in steps:
            for model in pins.models:
                install_model(places, model, pins)
    say("set-up", f"everything is in place ({time.monotonic() - started:.1f} s)")


def _explain(error: OSError) -> str:
    place = error.filename or ROOT
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"There is no space left for {place}; free some and run the set-up again, it goes on where it stopped."
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"{place} cannot be written by this user; use a clone in a folder of your own, or make this one yours."
    return f"{error.strerror or error}: {place}"


def _stop(_signal, _frame) -> None:
    raise KeyboardInterrupt
