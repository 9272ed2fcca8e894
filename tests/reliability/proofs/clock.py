"""The machine's clock jumps by an hour and by ten years, in both directions: time limits stay correct.

libfaketime replaces the clock of the process. The monotonic clock is not changed, as when a real clock is
set.
"""

import contextlib
import json
import tempfile
import time
from pathlib import Path

from support.companion import NO_LIBRARY, clock_of, faketime
from support.effort import Effort
from support.exchange import Lost, ask, connect, read_answer, request
from support.lookdown import DETECT, TINY, lookdown
from support.places import OFFICE, SAMPLES
from support.row import Row

JUMPS = ("+1h", "-1h", "+3650d", "-3650d")
LIMIT_SECONDS = 2.0
SLACK_SECONDS = 1.0


def prove(effort: Effort) -> list[Row]:
    """Makes all jumps one after the other in one server."""
    del effort
    row = Row("clock jumps", f"{', '.join(JUMPS)}, back to the truth after each")
    library = faketime()
    if library is None:
        row.skipped = NO_LIBRARY
        return [row]
    with tempfile.TemporaryDirectory() as name:
        clock, calibrations = Path(name) / "clock", Path(name) / "calibrations"
        calibrations.mkdir()
        (calibrations / "office.json").write_bytes((SAMPLES / "calibrations" / "office.json").read_bytes())
        clock.write_text("+0", encoding="ascii")
        environment = clock_of(library, clock)
        settings = TINY | {
            "LOG__FILTER": "error",
            "SERVER__REQUEST_TIMEOUT_MILLIS": str(int(LIMIT_SECONDS * 1000)),
            "CALIBRATIONS__POLL_SECONDS": "1",
        }
        with lookdown(settings, calibrations=calibrations, environment=environment) as server:
            years = {_jump(row, server.address, clock, jump) for jump in JUMPS}
            row.require(server.process.poll() is None, "the server ended")
    row.seen = (
        f"reports dated {', '.join(sorted(years))}; uploads were limited after {LIMIT_SECONDS:.0f} s all the same"
    )
    return [row]


def _jump(row: Row, address: str, clock: Path, jump: str) -> str:
    """Returns the year in the date of a report after the jump."""
    began = time.monotonic()
    frame = OFFICE.read_bytes()
    whole = request("POST", DETECT, frame, {"Content-Type": "image/jpeg", "Connection": "close"})
    with contextlib.closing(connect(address)) as slow:
        slow.sendall(whole[: len(whole) // 2])
        clock.write_text(jump, encoding="ascii")
        report = ask(address, "POST", DETECT, frame)
        try:
            status = read_answer(slow).status
        except (Lost, OSError) as error:
            status = f"nothing ({error})"
        seconds = time.monotonic() - began
    total = report.json()["timings_ms"]["total"] if report.status == 200 else -1.0
    row.require(report.status == 200, f"{jump}: a frame was answered {report.status}")
    row.require(0.0 <= total < 1000.0, f"{jump}: a frame is said to have taken {total} ms")
    row.require(status == 408, f"{jump}: an upload that stopped was answered {status}")
    on_time = LIMIT_SECONDS - SLACK_SECONDS < seconds < LIMIT_SECONDS + SLACK_SECONDS
    row.require(on_time, f"{jump}: it was answered after {seconds:.1f} s, the limit is {LIMIT_SECONDS:.0f} s")
    body = json.loads((SAMPLES / "calibrations" / "office.json").read_bytes())
    body["lens"]["focal"] += 1.0
    put = ask(address, "PUT", "/calibrations/office", json.dumps(body).encode()).status
    row.require(put == 200, f"{jump}: a calibration was answered {put}")
    clock.write_text("+0", encoding="ascii")
    again = ask(address, "POST", DETECT, frame).status
    row.require(again == 200, f"back from {jump}: a frame was answered {again}")
    return report.json()["received_at"][:4] if report.status == 200 else "?"
