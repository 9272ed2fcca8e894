"""kill -9 during writes of calibrations: a file is the old or the new one, and acknowledged writes are kept."""

import contextlib
import itertools
import json
import os
import random
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

from harness.processes import BenchError
from support.effort import Effort
from support.exchange import Lost, ask
from support.lookdown import TINY, lookdown
from support.places import SAMPLES
from support.row import Row

CAMERAS = ("north", "east", "south", "west")
FOCAL = 300.0
"""The focal length of the first version. Each later version increases it."""
OLD_SECONDS = 3600.0
SETTINGS = TINY | {"LOG__FILTER": "warn", "CALIBRATIONS__POLL_SECONDS": "1"}


@dataclass
class Writer:
    """Writes versions of a calibration one after the other, and records its progress."""

    camera: str
    answered: float | None = None
    """The last version whose write was acknowledged."""
    sent: float | None = None
    """The last version that was sent."""
    refusals: list[str] = field(default_factory=list)

    def write(self, address: str, versions: itertools.count) -> None:
        """Runs until the server is gone."""
        template = json.loads((SAMPLES / "calibrations" / "office.json").read_text(encoding="utf-8"))
        while True:
            focal = round(FOCAL + next(versions) / 1000, 3)
            template |= {"id": self.camera, "lens": template["lens"] | {"focal": focal}}
            self.sent = focal
            try:
                answer = ask(address, "PUT", f"/calibrations/{self.camera}", json.dumps(template).encode())
            except (Lost, OSError):
                return
            if answer.status not in (200, 201):
                self.refusals.append(f"PUT answered {answer.status}: {answer.body[:200]!r}")
                return
            self.answered = focal


def prove(effort: Effort) -> list[Row]:
    """Kills the server `effort.kills` times."""
    row = Row("kill -9 while calibrations are written", f"{effort.kills} times, {len(CAMERAS)} writers without a pause")
    writers = [Writer(camera) for camera in CAMERAS]
    versions, in_between = itertools.count(), 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for _ in range(effort.kills):
            try:
                _kill_once(folder, writers, versions)
            except BenchError as error:
                row.faults.append(f"it did not start again: {error}")
                break
            for writer in writers:
                in_between += _check(folder, writer, row)
            _age(folder)
        left = sorted(file.name for file in folder.iterdir() if file.stem not in CAMERAS)
    written = next(versions)
    row.seen = (
        f"{written} writes, {len(row.faults)} lost or damaged; {in_between} times the one under way was stored; "
        f"{len(left)} unfinished files left"
    )
    row.require(len(left) <= len(CAMERAS), f"unfinished files are never removed: {len(left)}, such as {left[:2]}")
    return [row]


def _kill_once(folder: Path, writers: list[Writer], versions: itertools.count) -> None:
    with lookdown(SETTINGS, calibrations=folder) as server:
        for writer in writers:
            if writer.answered is not None:
                _check_served(server.address, folder, writer)
        threads = [threading.Thread(target=writer.write, args=(server.address, versions)) for writer in writers]
        for thread in threads:
            thread.start()
        time.sleep(random.uniform(0.01, 0.15))
        server.process.kill()
        server.process.wait()
        for thread in threads:
            thread.join()


def _age(folder: Path) -> None:
    """Makes unfinished files old: later writes remove old ones only."""
    long_ago = time.time() - OLD_SECONDS
    for file in folder.iterdir():
        if file.stem not in CAMERAS:
            os.utime(file, (long_ago, long_ago))


def _check_served(address: str, folder: Path, writer: Writer) -> None:
    """Checks that a restarted server serves the content of the file."""
    served = ask(address, "GET", f"/calibrations/{writer.camera}")
    focal = served.json()["lens"]["focal"] if served.status == 200 else f"status {served.status}"
    if focal != _stored(folder, writer):
        writer.refusals.append(f"{writer.camera}: the file has {_stored(folder, writer)}, served is {focal}")


def _stored(folder: Path, writer: Writer) -> float | None:
    file = folder / f"{writer.camera}.json"
    return json.loads(file.read_text(encoding="utf-8"))["lens"]["focal"] if file.exists() else None


def _check(folder: Path, writer: Writer, row: Row) -> bool:
    """Returns true if the file holds an unacknowledged version. Records a fault if that is not the last sent one."""
    row.faults += writer.refusals
    writer.refusals.clear()
    stored = "no file"
    with contextlib.suppress(ValueError):
        stored = _stored(folder, writer)
    if stored not in (writer.answered, writer.sent):
        row.faults.append(
            f"{writer.camera}: {stored} is stored, {writer.answered} was answered, {writer.sent} was sent"
        )
    ahead = stored == writer.sent != writer.answered
    writer.answered = stored if isinstance(stored, float) else None
    return ahead
