"""The clocks of the server, of `lookdown count` and of a camera jump: counting continues within a stated time, and no
report is counted twice."""

import contextlib
import tempfile
import threading
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

from support.companion import NO_LIBRARY, clock_of, count, faketime, metric
from support.effort import Effort
from support.exchange import Lost, ask
from support.lookdown import DETECT, TINY, lookdown
from support.places import OFFICE
from support.row import Row

AGAIN_SECONDS = 12.0
"""Longest time without a counted report after a jump of a clock."""
RECONNECT_SECONDS = 15.0
"""Longest pause of a connection that failed."""
FRESH_REPORTS = 5
JUMPS = ("+1h", "-1h", "+3650d", "-3650d")
COUNTED = "lookdown_count_reports_total"


class Camera:
    """Sends frames to the current server, five a second."""

    def __init__(self) -> None:
        self.address = ""
        self.ahead_seconds: float | None = None
        self.answered = 0
        self._ended = threading.Event()

    def send(self) -> None:
        """Sends frames until the end."""
        frame = OFFICE.read_bytes()
        while not self._ended.wait(0.2):
            path = f"{DETECT}&camera=hall"
            if self.ahead_seconds is not None:
                captured = datetime.now(UTC) + timedelta(seconds=self.ahead_seconds)
                path += f"&captured_at={captured.strftime('%Y-%m-%dT%H:%M:%S.%fZ')}"
            # A server that ends refuses the connection, or does not answer.
            with contextlib.suppress(Lost, OSError):
                self.answered += ask(self.address, "POST", path, frame).status == 200

    @contextlib.contextmanager
    def sending(self, address: str) -> Iterator[None]:
        """Sends frames while the block runs."""
        self.address = address
        thread = threading.Thread(target=self.send)
        thread.start()
        try:
            yield
        finally:
            self._ended.set()
            thread.join()


def prove(effort: Effort) -> list[Row]:
    """Makes all jumps one after the other, with a restart of the server after the first and the last."""
    jumps = JUMPS if effort.name == "long" else JUMPS[:2]
    changes = f"{', '.join(jumps)} of the server, of the counts and of the camera; restarts of the server"
    row = Row("clock jumps of counts", changes)
    library = faketime()
    if library is None:
        row.skipped = NO_LIBRARY
        return [row]
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        folder, camera = Path(name), Camera()
        clocks = {part: folder / part for part in ("server", "count")}
        for clock in clocks.values():
            clock.write_text("+0", encoding="ascii")
        settings = TINY | {"LOG__FILTER": "error"}
        slowest = 0.0
        with contextlib.ExitStack() as first:
            server = first.enter_context(lookdown(settings, environment=clock_of(library, clocks["server"])))
            counts = stack.enter_context(
                count(server.address, folder / "counts.sqlite", clock_of(library, clocks["count"]))
            )
            stack.enter_context(camera.sending(server.address))
            slowest = max(slowest, _again(row, counts.address, "the start", AGAIN_SECONDS))
            for jump in jumps:
                for part, clock in clocks.items():
                    for value in (jump, "+0"):
                        clock.write_text(value, encoding="ascii")
                        slowest = max(slowest, _again(row, counts.address, f"{value} of the {part}", AGAIN_SECONDS))
            for ahead in (4.0, 3600.0, -3600.0, None):
                camera.ahead_seconds = ahead
                slowest = max(slowest, _again(row, counts.address, f"a camera {ahead} s ahead", AGAIN_SECONDS))
            # The next server begins with the right clock.
            clocks["server"].write_text(jumps[0], encoding="ascii")
            _again(row, counts.address, f"{jumps[0]} of the server", AGAIN_SECONDS)
        clocks["server"].write_text("+0", encoding="ascii")
        port = int(server.address.rpartition(":")[2])
        with lookdown(settings, environment=clock_of(library, clocks["server"]), port=port):
            limit = AGAIN_SECONDS + RECONNECT_SECONDS
            restarted = _again(row, counts.address, "a restart with an earlier clock", limit)
            total, resets = (metric(counts.address, name) for name in (COUNTED, "lookdown_count_position_resets_total"))
    row.require(total <= camera.answered, f"{total:.0f} of {camera.answered} reports are counted")
    row.require(resets > 0, "the earlier event IDs were not noticed")
    row.seen = (
        f"counting again within {slowest:.1f} s of a jump and {restarted:.1f} s of a restart; "
        f"{total:.0f} of {camera.answered} reports counted"
    )
    return [row]


def _again(row: Row, address: str, cause: str, limit: float) -> float:
    """Returns the seconds until reports are counted after a change."""
    began, before = time.monotonic(), metric(address, COUNTED)
    while (counted := metric(address, COUNTED) - before) < FRESH_REPORTS:
        if time.monotonic() - began > limit:
            row.require(False, f"{cause}: {counted:.0f} reports were counted within {limit:.0f} s")
            break
        time.sleep(0.1)
    return time.monotonic() - began
