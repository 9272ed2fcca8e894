"""Proves that the server survives faults: `run.py short|long [PART...]`, all parts by default.

Each part prints and stores a row for each result. Exits with 1 when a proof fails.
"""

import json
import signal
import sys
import time
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "lab/benches"))

from harness.machine import made  # noqa: E402
from harness.processes import BenchError  # noqa: E402
from proofs import (  # noqa: E402
    cameras,
    companions,
    contract,
    descriptors,
    disk,
    floods,
    kill,
    memory,
    overload,
    reload,
    rude,
    soak,
    stop,
    streams,
)
from support.effort import LONG, SHORT  # noqa: E402
from support.places import WORK  # noqa: E402
from support.row import Row  # noqa: E402

PARTS = (
    contract,
    kill,
    stop,
    reload,
    disk,
    descriptors,
    memory,
    companions,
    streams,
    cameras,
    rude,
    floods,
    overload,
    soak,
)
EFFORTS = {effort.name: effort for effort in (SHORT, LONG)}


def main(arguments: list[str]) -> int:
    """Returns the exit status."""
    named = {part.__name__.rpartition(".")[2]: part for part in PARTS}
    # Started servers are stopped on exit.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    wanted, *parts = arguments or [""]
    unknown = [name for name in parts if name not in named]
    if wanted not in EFFORTS or unknown:
        print(f"usage: run.py short|long [{'|'.join(named)}]...", file=sys.stderr)
        return 2
    try:
        rows = [row for name in parts or named for row in _prove(name, named[name], EFFORTS[wanted])]
    except KeyboardInterrupt:
        return 130
    failed = sum(bool(row.faults) for row in rows)
    skipped = sum(bool(row.skipped) for row in rows)
    print(f"reliability: {len(rows) - failed - skipped} passed, {failed} failed, {skipped} skipped")
    return 1 if failed else 0


def _prove(name: str, part, effort) -> list[Row]:
    about, began = made() | {"effort": effort.name}, time.monotonic()
    try:
        rows = part.prove(effort)
    except BenchError as error:
        rows = [Row(name, "could not be tried", faults=[str(error)])]
    seconds = time.monotonic() - began
    for row in rows:
        print(f"{row.verdict():<8} {row.name}: {row.skipped or row.done + '; ' + row.seen}", flush=True)
        for fault in row.faults:
            print(f"         ! {fault}", flush=True)
    print(f"         {name}: {seconds:.0f} s", flush=True)
    WORK.mkdir(parents=True, exist_ok=True)
    kept = {"made": about, "seconds": seconds, "rows": [row.as_json() for row in rows]}
    (WORK / f"{effort.name}-{name}.json").write_text(json.dumps(kept, indent=1), encoding="utf-8")
    return rows


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
