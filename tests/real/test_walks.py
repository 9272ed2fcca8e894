"""Rendered walks through an RTSP server, `lookdown watch`, the server and `lookdown count`: counted and true crossings,
and the CPU time of each process.

The clip is made of our own renders: `lab/training/make.py walks`. `WALKS_ROUNDS` repeats it, `WALKS_RATE=2` takes
two frames per second of it, `WALKS_RATES="1 2 5 10"` are
the frames per second of the CPU times, `WALKS_FOLLOW=false` searches every frame, and `WALKS_TRACKS` names a file that
gets the tracks.
"""

import contextlib
import json
import os
import signal
import subprocess
import tempfile
import time
import unittest
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cameras import rtsp_camera
from harness.places import LOOKDOWN
from harness.processes import Server, free_ports
from harness.usage import usage_of
from state import wait_until
from support.lookdown import lookdown
from test_count import Count
from test_watch import Watch

CLIP = Path(__file__).resolve().parent / "walks"
TRUTH = json.loads((CLIP / "truth.json").read_text(encoding="utf-8"))
CAMERA = "walks"
ROUNDS = int(os.environ.get("WALKS_ROUNDS", "1"))
RATE = int(os.environ.get("WALKS_RATE", TRUTH["frames_per_second"]))
RATES = [int(rate) for rate in os.environ.get("WALKS_RATES", "5").split()]
FOLLOW = os.environ.get("WALKS_FOLLOW", "true")
MEASURED_SECONDS = float(os.environ.get("WALKS_SECONDS", "20"))
WARM_SECONDS = 5.0
STREAM_RATE = 10
"""Frames per second of the stream whose CPU times are measured."""
ERROR_SHARE = 0.05
"""Missed and invented crossings that the test permits. docs/lab/count-accuracy.md has the measured ones."""


@dataclass
class Chain:
    """The running processes."""

    server: Server
    watch: Watch
    count: Count

    def cpu_seconds(self) -> dict[str, float]:
        """The CPU time of each process with its children since its start."""
        pids = {"watch": self.watch.process.pid, "server": self.server.pid, "count": self.count.process.pid}
        return {name: usage_of(pid).cpu_seconds for name, pid in pids.items()}

    def tracks(self) -> dict:
        """The current tracks and the crossings of the lines."""
        return self.count.get(f"/counts/{CAMERA}/tracks") or {"tracks": [], "lines": []}


class Walks(unittest.TestCase):
    """Counts and costs of the clip."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.calibrations = self.folder / "calibrations"
        self.calibrations.mkdir()
        text = (CLIP / "calibration.json").read_text(encoding="utf-8")
        (self.calibrations / f"{CAMERA}.json").write_text(text, encoding="utf-8")
        self.frames = self.folder / "frames"
        self.frames.mkdir()
        images = ["-q:v", "2", "-start_number", "0", self.frames / "%d.jpg"]
        subprocess.run(["ffmpeg", "-v", "error", "-i", CLIP / "walks.mp4", *images], check=True)

    @contextlib.contextmanager
    def chain(self, stream_rate: int, rate: int) -> Iterator[Chain]:
        """Runs all processes: a stream of the clip, of which `rate` frames per second are sent."""
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        (port,) = free_ports(1)
        with contextlib.ExitStack() as stack:
            server = stack.enter_context(lookdown({"MODEL__PATH": ""}, calibrations=self.calibrations))
            settings = folder / "count.toml"
            settings.write_text(
                f'[upstream]\nurl = "http://{server.address}"\n[counts]\nlisten = "127.0.0.1:{port}"\n'
                f'path = "{folder / "counts.sqlite"}"\n',
                encoding="utf-8",
            )
            count = Count(settings, folder / "count.log", port)
            stack.callback(count.stop, signal.SIGKILL)
            rtsp = stack.enter_context(rtsp_camera(self.frames, stream_rate))
            cameras = folder / "cameras.toml"
            cameras.write_text(
                f'[upstream]\nurl = "http://{server.address}"\n[[cameras]]\nname = "{CAMERA}"\ncalibration = "{CAMERA}"\n'
                f'url = "rtsp://127.0.0.1:{rtsp}/stream"\nprofile = "fast"\nevery = "{1000 // rate}ms"\n'
                f"follow = {FOLLOW}\n"
                "parameters = { score_threshold = 0.06 }\n",
                encoding="utf-8",
            )
            watch = Watch([str(cameras)], folder / "watch.log")
            stack.callback(watch.stop, signal.SIGKILL)
            try:
                wait_until(lambda: watch.sent(CAMERA) > 0, "the first frame is sent", 60)
                yield Chain(server, watch, count)
            except AssertionError as error:
                raise AssertionError(f"{error}\n{watch.text}") from None

    def test_recordings_of_two_cameras_share_a_store(self):
        store, csv = self.folder / "counts.sqlite", self.folder / "counts.csv"
        calibration = ["--calibration", CLIP / "calibration.json", "--start", "2026-11-22T09:00:00Z"]
        clip = [LOOKDOWN, "count", CLIP / "walks.mp4", *calibration, "--profile", "fast"]

        def counted(camera: str) -> subprocess.CompletedProcess:
            own = ["--camera", camera, "--store", store, "--csv", csv, "--annotate", self.folder / f"{camera}.mp4"]
            return subprocess.run([*clip, *own], capture_output=True, text=True, check=False)

        for camera in ("hall", "yard"):
            done = counted(camera)
            self.assertEqual(done.returncode, 0, done.stderr)
            names, values = (line.split(",") for line in csv.read_text(encoding="utf-8").splitlines())
            row = dict(zip(names, values, strict=True))
            wrong = crossings = 0
            for line, directions in TRUTH["crossings"].items():
                for direction, true in directions.items():
                    wrong += abs(true - int(row[f"line.{line}.{direction}"]))
                    crossings += true
            self.assertLessEqual(wrong, ERROR_SHARE * crossings, row)
        again = counted("hall")
        self.assertEqual(again.returncode, 1)
        self.assertIn("counted already", again.stderr)

    def test_walks_through_rtsp_are_counted(self):
        rows = []
        with self.chain(TRUTH["frames_per_second"], RATE) as chain:
            started = time.monotonic()
            sent = chain.watch.sent(CAMERA)
            # The clip begins and ends with 2 s without a crossing: whole rounds since the first frame are counted,
            # also if it was not that of the clip.
            ends = started + ROUNDS * TRUTH["seconds"]
            while time.monotonic() < ends:
                answer = chain.tracks()
                rows.append({"seconds": time.monotonic() - started, **answer})
                time.sleep(0.2)
            rate = (chain.watch.sent(CAMERA) - sent) / (time.monotonic() - started)
            (camera,) = chain.count.get("/counts")
            too_low = camera.get("too_low_since", "never")
        if path := os.environ.get("WALKS_TRACKS"):
            Path(path).write_text(json.dumps(rows), encoding="utf-8")
        counted = {line["line"]: line["crossings"] for line in rows[-1]["lines"]}
        print(f"\n{rate:.2f} frames/s, {ROUNDS} rounds, counts may be too low since {too_low}")
        wrong = crossings = 0
        for line, directions in TRUTH["crossings"].items():
            for direction, once in directions.items():
                true = once * ROUNDS
                print(f"  {line} {direction}: true {true}, counted {counted[line][direction]}")
                wrong += abs(true - counted[line][direction])
                crossings += true
        self.assertLessEqual(wrong, ERROR_SHARE * crossings)

    def test_cpu_time_per_camera(self):
        print("\ncores: frames/s sent, watch with ffmpeg, server, count")
        for rate in RATES:
            with self.subTest(rate), self.chain(STREAM_RATE, rate) as chain:
                time.sleep(WARM_SECONDS)
                before, sent, since = chain.cpu_seconds(), chain.watch.sent(CAMERA), time.monotonic()
                time.sleep(MEASURED_SECONDS)
                after, seconds = chain.cpu_seconds(), time.monotonic() - since
                cores = {name: (after[name] - before[name]) / seconds for name in after}
                sent = (chain.watch.sent(CAMERA) - sent) / seconds
                shown = ", ".join(f"{name} {value:.3f}" for name, value in cores.items())
                print(f"  {rate}: {sent:.2f} frames/s, {shown}, sum {sum(cores.values()):.3f}")
                self.assertGreater(sent, 0)


if __name__ == "__main__":
    unittest.main()
