"""The number of people on the page of `lookdown run`, with the README's command and beside other work.

`NUMBER_ROWS` names rows of `CONDITIONS`, with semicolons between, or `all` (default: those of `CI_ROWS`), `NUMBER_SECONDS`
is the time that is measured of each, and `NUMBER_SERIES` a file that gets the series. Rows with a slow search infer on another server, which waits before each answer.
"""

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
import unittest
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import mean, pstdev

from cameras import rtsp_camera
from harness.places import ROOT, model
from harness.processes import Server, free_ports, running
from state import wait_until
from support.control_group import cpu_share
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent
CAMERA = "hall"
SECONDS = float(os.environ.get("NUMBER_SECONDS", "40"))
SETTLING_SECONDS = 20.0
"""The time after the first report in which profile and rate are chosen and tracks begin."""
BUSY = [sys.executable, "-c", "while True: pass"]
NETWORK = "nanodet_g_views_416"
RUNS_OF_A_SEARCH = 10
"""Runs of the network in a search with `fast`."""


@dataclass(frozen=True)
class Condition:
    """What else the machine does, and how `lookdown run` is started."""

    busy: int = 0
    """Processes that compute without a pause."""
    cores: float | None = None
    """A limit on the CPU time of `lookdown run`."""
    search_seconds: float = 0.0
    """The time that the network of a search waits."""
    flags: tuple[str, ...] = ()
    cameras: int = 1
    enters: bool = False
    """True for the clip in which people enter and leave."""
    empty: bool = False
    """True for those frames of it without people."""
    late_seconds: int = 3
    """The time in which a change must be shown."""


CONDITIONS = {
    "idle": Condition(),
    "busy 1": Condition(busy=1),
    "busy 2": Condition(busy=2),
    "busy 4": Condition(busy=4),
    "busy 8": Condition(busy=8),
    "1 core": Condition(cores=1.0),
    "half a core": Condition(cores=0.5),
    "search .3 s": Condition(search_seconds=0.3),
    "search 1.5 s": Condition(search_seconds=1.5),
    "search 4 s": Condition(search_seconds=4.0),
    "5/s fast, busy 2": Condition(busy=2, flags=("--every", "200ms", "--profile", "fast")),
    "two cameras, busy 2": Condition(busy=2, cameras=2),
    "enters, idle": Condition(enters=True),
    "enters, busy 4": Condition(busy=4, enters=True),
    "enters, search 1.5 s": Condition(search_seconds=1.5, enters=True),
    "enters, search 4 s": Condition(search_seconds=4.0, enters=True, late_seconds=10),
    "empty, idle": Condition(empty=True),
    "empty, busy 4": Condition(busy=4, empty=True),
    "empty, search 1.5 s": Condition(search_seconds=1.5, empty=True),
}
CI_ROWS = ("idle", "enters, search 1.5 s")
LEAST_WITHIN_ONE = 0.9
WALKERS = 6
"""Five people and a mannequin, in every frame of the clip of the walks."""
FRAMES_PER_SECOND = 5
PYTHON = ROOT / ".setup" / "real" / "v2_backend" / "bin" / "python"


@contextlib.contextmanager
def busy(count: int) -> Iterator[None]:
    """Other processes that use the processor."""
    processes = [subprocess.Popen(BUSY) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


@contextlib.contextmanager
def slow_network(search_seconds: float) -> Iterator[dict[str, str]]:
    """A network on another server that waits, and the settings that use it."""
    if not search_seconds:
        yield {}
        return
    (port,) = free_ports(1)
    wait = 2 * search_seconds / RUNS_OF_A_SEARCH
    command = [str(PYTHON), str(HERE / "slow_network.py"), str(port), str(model(NETWORK)), str(wait)]
    with running("slow_network", command, port, f"/v2/models/{NETWORK}/ready", {}) as server:
        settings = {"INFERENCE__BACKEND": "v2", "INFERENCE__URL": f"http://{server.address}"}
        settings |= {"INFERENCE__MODEL": NETWORK, "MODEL__PATH": str(model(NETWORK).parent)}
        yield settings | {"INFERENCE__TIMEOUT_MILLIS": "60000"}


@dataclass(frozen=True)
class Series:
    """The number on the page, once a second, and the true ones of that second and those before it."""

    shown: list[int]
    true: list[list[int]]

    def within_one(self) -> float:
        """The share of seconds in which the number is right within one."""
        rows = zip(self.shown, self.true, strict=True)
        return mean(min(abs(shown - true) for true in those) <= 1 for shown, those in rows)

    def __str__(self) -> str:
        changes = sum(a != b for a, b in zip(self.shown, self.shown[1:]))
        true = sum(a[-1] != b[-1] for a, b in zip(self.true, self.true[1:]))
        return (
            f"{mean(self.shown):.1f} ± {pstdev(self.shown):.1f}, within one {self.within_one():.0%}, "
            f"{60 * (changes - true) / len(self.shown):.0f} wrong changes a minute"
        )


class Number(unittest.TestCase):
    """The number on the page is right within one, whatever else the machine does."""

    def frames(self, condition: Condition) -> tuple[Path, list[int]]:
        """The folder of the frames of a clip, and the true number of each."""
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        clip = HERE / "walks" / "walks.mp4"
        if condition.enters or condition.empty:
            command = [PYTHON, HERE / "entering_walkers.py", clip, folder]
            true = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
            return folder, self.empty_frames(folder, true) if condition.empty else true
        images = ["-q:v", "2", "-start_number", "0", folder / "%d.jpg"]
        subprocess.run(["ffmpeg", "-v", "error", "-i", clip, *images], check=True)
        return folder, [WALKERS] * len(list(folder.iterdir()))

    def empty_frames(self, folder: Path, true: list[int]) -> list[int]:
        """Leaves the frames without people alone in a folder, numbered anew."""
        kept = 0
        for number, persons in enumerate(true):
            image = folder / f"{number}.jpg"
            if persons:
                image.unlink()
            else:
                image.rename(folder / f"{kept}.jpg")
                kept += 1
        return [0] * kept

    @contextlib.contextmanager
    def lookdown_run(self, condition: Condition, url: str) -> Iterator[Server]:
        """`lookdown run URL --name hall` under a condition."""
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        with contextlib.ExitStack() as stack:
            settings = stack.enter_context(slow_network(condition.search_seconds))
            settings |= {"STATE__PATH": folder / "state"}
            (folder / "calibrations").mkdir()
            command = ["run"]
            store = ["--store", folder / "counts.sqlite"]
            if condition.cameras == 1:
                command += [url, "--name", CAMERA, *condition.flags, *store]
            else:
                names = [CAMERA, *(f"other-{number}" for number in range(1, condition.cameras))]
                file = folder / "lookdown.toml"
                file.write_text("".join(f'[[cameras]]\nname = "{name}"\nurl = "{url}"\n' for name in names))
                command += [file, *store]
            cores = stack.enter_context(cpu_share("number", condition.cores)) if condition.cores else ()
            own = {"calibrations": folder / "calibrations", "command": command, "inside": cores}
            server = stack.enter_context(lookdown(settings, **own))
            stack.enter_context(busy(condition.busy))
            yield server

    def series(self, server: Server, condition: Condition, true: list[int]) -> Series:
        """The number of the camera in each second."""

        def row() -> dict | None:
            return next((row for row in json.loads(server.get("/results")) if row["camera"] == CAMERA), None)

        wait_until(row, "there is a report", 60)
        # The stream begins when it is read, and the first frame is sent at once.
        first = json.loads(server.get(f"/results/{CAMERA}/latest"))["captured_at"]
        age = datetime.now(UTC) - datetime.fromisoformat(first.replace("Z", "+00:00"))
        began = time.monotonic() - age.total_seconds()
        seconds = max(SECONDS, len(true) / FRAMES_PER_SECOND if condition.enters else 0)
        series = Series([], [])
        time.sleep(0 if condition.enters else SETTLING_SECONDS)
        measured = time.monotonic()
        while (passed := time.monotonic() - measured) < seconds:
            last = int((time.monotonic() - began) * FRAMES_PER_SECOND)
            those = range(max(0, last - condition.late_seconds * FRAMES_PER_SECOND), last + 1)
            series.shown.append(row()["persons"])
            series.true.append([true[number % len(true)] for number in those])
            time.sleep(max(0.0, len(series.shown) - passed))
        return series

    def test_number_is_right_beside_other_work(self):
        rows = os.environ.get("NUMBER_ROWS")
        seen = {}
        print()
        names = CONDITIONS if rows == "all" else rows.split(";") if rows else CI_ROWS
        for name in names:
            condition = CONDITIONS[name]
            frames, true = self.frames(condition)
            with self.subTest(name), rtsp_camera(frames, FRAMES_PER_SECOND) as port:
                with self.lookdown_run(condition, f"rtsp://127.0.0.1:{port}/stream") as server:
                    series = self.series(server, condition, true)
                    (camera,) = (row for row in json.loads(server.get("/cameras")) if row["name"] == CAMERA)
                print(f"  {name}: {series}; {camera['choice']}", flush=True)
                seen[name] = {"shown": series.shown, "true": [those[-1] for those in series.true]}
                self.assertGreaterEqual(series.within_one(), LEAST_WITHIN_ONE)
        if path := os.environ.get("NUMBER_SERIES"):
            Path(path).write_text(json.dumps(seen), encoding="utf-8")


if __name__ == "__main__":
    unittest.main()
