"""Runs the benchmarks: `run.py short|full|tell [PART...]`, all parts by default.

Each part measures, keeps its figures in raw/, and RESULTS.md is written anew from all that is there; `tell` only
does the latter.
"""

import signal
import sys
import time

from harness.effort import FULL, SHORT
from harness.processes import BenchError
from harness.results import measure, write
from parts import cameras, dashboards, lifetime, limit, peers, remap, whole

PARTS = {
    "The whole service": whole,
    "The limit: bare ONNX Runtime": limit,
    "Other servers": peers,
    "Remap": remap,
    "Start": lifetime,
    "Many cameras": cameras,
    "Dashboards": dashboards,
}
EFFORTS = {effort.name: effort for effort in (SHORT, FULL)}


def main(arguments: list[str]) -> int:
    """The exit status."""
    named = {part.__name__.rpartition(".")[2]: part for part in PARTS.values()}
    # Started servers are stopped at the exit.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    wanted, *parts = arguments or [""]
    unknown = [name for name in parts if name not in named]
    if wanted not in (*EFFORTS, "tell") or unknown:
        print(f"usage: run.py short|full|tell [{'|'.join(named)}]...", file=sys.stderr)
        return 2
    try:
        for name in (parts or named) if wanted in EFFORTS else ():
            print(f"bench      {name} ...", flush=True)
            began = time.monotonic()
            measure(named[name], EFFORTS[wanted])
            write(PARTS)
            print(f"bench      {name}: {time.monotonic() - began:.0f} s", flush=True)
        write(PARTS)
    except BenchError as error:
        print(f"\nThe benchmark stopped. {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
