"""`lookdown watch` with real cameras: MJPEG, a snapshot behind Digest, RTSP, a folder, standard input, and videos.

The longest test takes a minute, or `WATCH_SECONDS`.
"""

import contextlib
import json
import os
import signal
import subprocess
import tempfile
import time
import unittest
import urllib.request
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from statistics import median

from cameras import CLOCK_BITS, PASSWORD, USER, http_camera, proxy, rtsp_camera, rtsp_clock, shown_milliseconds
from harness.places import LOOKDOWN, SAMPLES
from harness.processes import free_ports
from state import wait_until
from support.lookdown import TINY, lookdown

SECONDS = float(os.environ.get("WATCH_SECONDS", "60"))
"""The duration of the test of faults."""
FAULTS = ("killed", "stalled", "cut", "corrupted")
FAULT_SECONDS = 4.0
RATE = 5
SIDE = 480
CHILDREN_SECONDS = 15.0
STREAM_RATE = 15
RECENT_FRAMES = 15
RECENT_SECONDS = 1
"""The interval. A decoder or encoder that holds a frame back until the next one makes frames older by it."""


class Watch:
    """A running `lookdown watch` with its log and metrics."""

    def __init__(self, arguments: list[str], log: Path):
        (port,) = free_ports(1)
        self.log, self.metrics_at = log, f"http://127.0.0.1:{port}/metrics"
        command = [LOOKDOWN, "watch", *arguments, "--metrics-listen", f"127.0.0.1:{port}"]
        with open(log, "wb") as output:
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=output)

    @property
    def text(self) -> str:
        """The log."""
        return self.log.read_text(encoding="utf-8", errors="replace")

    def metric(self, name: str, camera: str) -> float:
        """The value of a metric of a camera, 0 while there is none."""
        with contextlib.suppress(OSError), urllib.request.urlopen(self.metrics_at, timeout=5) as answer:
            for line in answer.read().decode().splitlines():
                if line.startswith(f'lookdown_watch_{name}{{camera="{camera}"'):
                    return float(line.rsplit(" ", 1)[1])
        return 0.0

    def sent(self, camera: str) -> float:
        """The number of frames with a report."""
        return self.metric("frames_sent_total", camera)

    def wait_for(self, camera: str, more: int, seconds: float = 30.0) -> float:
        """Waits for further reports of a camera, and returns the time that it took."""
        started, wanted = time.monotonic(), self.sent(camera) + more
        try:
            wait_until(lambda: self.sent(camera) >= wanted, f"{camera} has {more} more reports", seconds)
        except AssertionError as error:
            raise AssertionError(f"{error}\n{self.text}") from None
        return time.monotonic() - started

    def usage(self) -> tuple[int, int, int]:
        """The number of file descriptors, the resident memory in KiB, and the number of child processes."""
        folder = Path("/proc") / str(self.process.pid)
        status = (folder / "status").read_text(encoding="utf-8")
        memory = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS:"))
        return len(list((folder / "fd").iterdir())), memory, len(children(self.process.pid))

    def stop(self, number: int = signal.SIGTERM) -> int:
        """Stops it, and returns its exit status."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.process.pid, number)
        return self.process.wait(timeout=20)


def children(pid: int) -> list[int]:
    """The child processes of a process."""
    tasks = (Path("/proc") / str(pid) / "task").iterdir()
    return [int(child) for task in tasks for child in (task / "children").read_text().split()]


class Cameras(unittest.TestCase):
    """Frames of cameras at the server."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.frames_folder = self.folder / "frames"
        self.frames_folder.mkdir()
        for number, sample in enumerate(sorted(SAMPLES.glob("*.jpg"))):
            scale = ["-vf", f"scale={SIDE}:{SIDE}", "-q:v", "3", self.frames_folder / f"{number}.jpg"]
            subprocess.run(["ffmpeg", "-v", "error", "-i", sample, *scale], check=True)
        self.frames = [path.read_bytes() for path in sorted(self.frames_folder.glob("*.jpg"))]
        self.server = self.enterContext(lookdown(TINY))
        self.password = self.folder / "password"
        self.password.write_text(PASSWORD + "\n", encoding="utf-8")

    @contextlib.contextmanager
    def watching(self, *arguments: object) -> Iterator[Watch]:
        """Runs `lookdown watch` against the server of the test."""
        arguments = [str(argument) for argument in arguments]
        watch = Watch([*arguments, "--server", f"http://{self.server.address}"], self.folder / "watch.log")
        try:
            yield watch
        finally:
            watch.stop(signal.SIGKILL)

    def configured(self, cameras: dict[str, str], extra: str = "") -> Path:
        """A file of cameras with these URLs."""
        path = self.folder / "cameras.toml"
        text = f'[camera_defaults]\nevery = "{1000 // RATE}ms"\nstall_after = "2s"\nprofile = "fast"\n{extra}\n'
        for name, url in cameras.items():
            text += f'[[cameras]]\nname = "{name}"\nurl = "{url}"\n'
            if name == "digest":
                text += f'user = "{USER}"\npassword_file = "{self.password}"\n'
        path.write_text(text, encoding="utf-8")
        return path

    def recovered(self, watch: Watch, cameras: list[str]) -> dict[str, float]:
        """The time until each camera has two more reports."""
        started, wanted = time.monotonic(), {name: watch.sent(name) + 2 for name in cameras}
        times: dict[str, float] = {}

        def are_all() -> bool:
            for name in cameras:
                if name not in times and watch.sent(name) >= wanted[name]:
                    times[name] = time.monotonic() - started
            return len(times) == len(cameras)

        wait_until(are_all, "all cameras have reports again", 60)
        return times

    def latest(self, camera: str) -> dict:
        """The latest report of a camera."""
        return json.loads(self.server.get(f"/results/{camera}/latest"))

    def test_a_damaged_camera_recovers_and_slows_no_other(self):
        http = self.enterContext(http_camera(self.frames, RATE))
        rtsp = self.enterContext(rtsp_camera(self.frames_folder, RATE, USER, PASSWORD))
        bad = {"mjpeg": http, "digest": http, "rtsp": rtsp}
        proxies = {name: self.enterContext(proxy(port)) for name, port in bad.items()}
        login = f"{USER}:s%40cret%2Fof%3Agate"
        urls = {
            "good": f"http://127.0.0.1:{http}/stream",
            "mjpeg": f"http://127.0.0.1:{proxies['mjpeg'].port}/stream",
            "digest": f"http://127.0.0.1:{proxies['digest'].port}/snap",
            "rtsp": f"rtsp://{login}@127.0.0.1:{proxies['rtsp'].port}/stream",
        }
        recoveries: dict[str, dict[str, list[float]]] = {name: {fault: [] for fault in FAULTS} for name in bad}
        slowest = float("inf")
        with self.watching(self.configured(urls)) as watch:
            for name in urls:
                watch.wait_for(name, 3)
            started = {name: watch.sent(name) for name in urls}
            time.sleep(5)
            rates = {name: (watch.sent(name) - started[name]) / 5 for name in urls}
            first = watch.usage()
            ends = time.monotonic() + SECONDS
            rounds = 0
            while time.monotonic() < ends:
                fault = FAULTS[rounds % len(FAULTS)]
                rounds += 1
                before, since = watch.sent("good"), time.monotonic()
                for each in proxies.values():
                    each.set(fault)
                time.sleep(FAULT_SECONDS)
                for each in proxies.values():
                    each.set("normal")
                for name, seconds in self.recovered(watch, list(bad)).items():
                    recoveries[name][fault].append(seconds)
                slowest = min(slowest, (watch.sent("good") - before) / (time.monotonic() - since))
            last = watch.usage()
            self.assertEqual(watch.metric("reconnects_total", "good"), 0, watch.text)
            for name in bad:
                self.assertGreater(watch.metric("reconnects_total", name), 0)
            self.assertNotIn(PASSWORD, watch.text)
            self.assertNotIn("s%40cret", watch.text)
            self.assertEqual(watch.stop(), 0)
        print(f"\nreports per second {rates}\n{rounds} rounds; seconds until two reports after a fault:")
        for name, faults in recoveries.items():
            figures = (f"{fault} {max(times, default=0):.1f}" for fault, times in faults.items())
            print(f"  {name}, at most: {', '.join(figures)}")
        print(f"slowest rate of the good camera {slowest:.2f}/s; descriptors, KiB, children: {first} → {last}")
        # The cameras themselves are slower on a busy machine.
        self.assertGreater(slowest, 0.7 * rates["good"])
        self.assertLessEqual(last[0], first[0] + 4)
        self.assertLess(last[1], first[1] + 16 * 1024)
        self.assertLessEqual(last[2], first[2])

    def test_a_wrong_password_is_one_message(self):
        http = self.enterContext(http_camera(self.frames, RATE))
        rtsp = self.enterContext(rtsp_camera(self.frames_folder, RATE, USER, PASSWORD))
        urls = {
            "snapshot": f"http://{USER}:wr0ng@127.0.0.1:{http}/snap",
            "rtsp": f"rtsp://{USER}:wr0ng@127.0.0.1:{rtsp}/stream",
            "none": f"http://127.0.0.1:{http}/snap",
        }
        with self.watching(self.configured(urls)) as watch:
            wait_until(lambda: watch.text.count("refuses the user name") == 2, f"both are logged\n{watch.text}")
            time.sleep(5)
            self.assertEqual(watch.text.count("refuses the user name"), 2, watch.text)
            self.assertEqual(watch.text.count("requires a user name"), 1, watch.text)
            self.assertEqual(watch.text.count(" WARN "), 3, watch.text)
            self.assertNotIn("wr0ng", watch.text)

    def test_passwords_are_in_no_list_of_processes(self):
        rtsp = self.enterContext(rtsp_camera(self.frames_folder, RATE, USER, PASSWORD))
        source = f"rtsp://127.0.0.1:{rtsp}/stream"
        flags = ("--name", "gate", "--every", "200ms", "--user", USER, "--password-file", self.password)
        with self.watching(source, *flags) as watch:
            watch.wait_for("gate", 2)
            (child,) = children(watch.process.pid)
            for pid in (watch.process.pid, child):
                for about in ("cmdline", "environ"):
                    self.assertNotIn(b"s@cret", (Path("/proc") / str(pid) / about).read_bytes())
            watch.stop(signal.SIGKILL)
            ended = lambda: not (Path("/proc") / str(child)).exists()
            wait_until(ended, "ffmpeg ends without its parent", CHILDREN_SECONDS)

    def test_changes_of_the_file_apply_to_changed_cameras_only(self):
        http = self.enterContext(http_camera(self.frames, RATE))
        url = f"http://127.0.0.1:{http}/stream"
        path = self.configured({"a": url, "b": url})
        with self.watching(path) as watch:
            watch.wait_for("a", 2)
            before = watch.sent("a")
            self.configured({"a": url, "c": url})
            watch.wait_for("c", 2)
            self.assertGreaterEqual(watch.sent("a"), before)
            wait_until(lambda: watch.sent("b") == 0, "b is gone")
            path.write_text("[[cameras]]\nwidht = 1\n", encoding="utf-8")
            wait_until(lambda: "unknown field `widht`" in watch.text, "the problem is logged")
            watch.wait_for("a", 2)
            self.assertEqual(watch.text.count("unknown field"), 1)

    def test_a_folder_and_standard_input_are_sources(self):
        drop = self.folder / "drop"
        drop.mkdir()
        with self.watching(drop, "--name", "drop", "--every", "200ms") as watch:
            for number in range(3):
                (drop / "new.part").write_bytes(self.frames[number % 3])
                (drop / "new.part").rename(drop / f"{number}.jpg")
                watch.wait_for("drop", 1)
        self.assertTrue(self.latest("drop")["captured_at"])
        command = [LOOKDOWN, "watch", "-", "--name", "pipe", "--server", f"http://{self.server.address}"]
        subprocess.run(command, input=self.frames[0], check=True, capture_output=True, timeout=20)
        self.assertEqual(self.latest("pipe")["image"]["width"], SIDE)

    def test_one_command_serves_watches_and_counts(self):
        http = self.enterContext(http_camera(self.frames, RATE))
        settings = TINY | {"COUNTS__PATH": self.folder / "counts.sqlite"}
        command = ["run", f"http://127.0.0.1:{http}/stream", "--name", "hall"]
        with lookdown(settings, command=command) as server:
            wait_until(lambda: json.loads(server.get("/results")), "there is a result", 30)
            origin = f"http://{server.address}"
            with urllib.request.urlopen(f"{origin}/", timeout=10) as page:
                self.assertEqual(page.headers.get_content_type(), "text/html")
                self.assertIn("<h1", page.read().decode())
            with urllib.request.urlopen(f"{origin}/results/hall/events", timeout=10) as events:
                self.assertEqual(events.headers.get_content_type(), "text/event-stream")
                lines = iter(events.readline, b"")
                data = next(line for line in lines if line.startswith(b"data:"))
            self.assertEqual(json.loads(data.removeprefix(b"data:"))["camera"], "hall")
            server.process.send_signal(signal.SIGINT)
            self.assertEqual(server.process.wait(timeout=20), 0)

    def test_a_video_is_read_as_pixels_where_they_fit(self):
        rtsp = self.enterContext(rtsp_camera(self.frames_folder, RATE))
        command = ["run", f"rtsp://127.0.0.1:{rtsp}/stream", "--name", "hall"]
        kept = {"RESULTS__IMAGES": "hall"}
        cases = [({}, "ppm"), ({"SERVER__MAX_BODY_BYTES": 3 * SIDE**2}, "mjpeg")]
        cases += [(kept, "mjpeg"), (kept | {"RESULTS__CONCEAL_IMAGES": "blur"}, "ppm")]
        for case, encoder in cases:
            settings = TINY | case | {"COUNTS__PATH": self.folder / "counts.sqlite"}
            with lookdown(settings, command=command) as server:
                wait_until(lambda server=server: json.loads(server.get("/results")), "there is a result", 30)
                (decoder,) = children(server.process.pid)
                arguments = (Path("/proc") / str(decoder) / "cmdline").read_text(encoding="utf-8")
                self.assertIn(f"\0-c:v\0{encoder}\0", arguments, case)
                if "RESULTS__IMAGES" in case:
                    self.assertTrue(server.get("/results/hall/latest.jpg").startswith(b"\xff\xd8"))

    def clip(self) -> Path:
        """A video of the frames, one per second."""
        path = self.folder / "clip.mp4"
        images = ["-framerate", "1", "-i", self.frames_folder / "%d.jpg"]
        subprocess.run(["ffmpeg", "-v", "error", *images, "-r", "10", "-pix_fmt", "yuv420p", path], check=True)
        return path

    def test_frames_of_a_live_stream_are_recent(self):
        ages = []
        with (
            rtsp_clock(STREAM_RATE) as port,
            lookdown(TINY | {"RESULTS__IMAGES": "clock"}) as self.server,
            self.watching(
                f"rtsp://127.0.0.1:{port}/stream", "--name", "clock", "--every", f"{RECENT_SECONDS}s"
            ) as watch,
        ):
            watch.wait_for("clock", 1)
            while len(ages) < RECENT_FRAMES:
                watch.wait_for("clock", 1)
                report = self.latest("clock")
                image = self.server.get("/results/clock/latest.jpg?draw=none")
                if self.latest("clock")["request_id"] == report["request_id"]:
                    captured = datetime.fromisoformat(report["captured_at"]).timestamp()
                    ages.append((round(captured * 1000) - shown_milliseconds(image)) % 2**CLOCK_BITS)
        print(f"\nage of a frame when `watch` has it: median {median(ages)} ms, greatest {max(ages)} ms")
        self.assertLess(median(ages), 1000 * RECENT_SECONDS / 2)

    def test_a_video_file_is_watched_in_real_time_to_its_end(self):
        started = time.monotonic()
        command = [LOOKDOWN, "watch", self.clip(), "--name", "clip", "--every", "200ms"]
        done = subprocess.run(
            [*command, "--server", f"http://{self.server.address}"], capture_output=True, check=False, timeout=60
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(time.monotonic() - started, len(self.frames) - 1.0)
        self.assertEqual(self.latest("clip")["image"]["width"], SIDE)
        rows = json.loads(self.server.get("/results/clip/history"))
        self.assertGreater(len(rows), 2 * len(self.frames))
        times = [row["report"]["captured_at"] for row in rows]
        self.assertEqual(len(set(times)), len(times))

    def test_a_playlist_is_not_read_as_a_video(self):
        clip, playlist = self.clip(), self.folder / "playlist.mp4"
        settings = {f"LOOKDOWN__{name}": value for name, value in TINY.items()}
        for text in (
            f"#EXTM3U\n#EXT-X-TARGETDURATION:2\n#EXTINF:2,\n{clip}\n#EXT-X-ENDLIST\n",
            f"ffconcat version 1.0\nfile {clip.name}\n",
        ):
            playlist.write_text(text, encoding="utf-8")
            command = [LOOKDOWN, "detect", playlist, "--every", "1s", "--profile", "fast"]
            done = subprocess.run(command, env=os.environ | settings, capture_output=True, check=False, timeout=60)
            self.assertNotEqual(done.returncode, 0)
            self.assertEqual(done.stdout, b"")

    def test_detect_reads_videos_and_standard_input(self):
        clip, out = self.clip(), self.folder / "out.mp4"
        settings = {f"LOOKDOWN__{name}": value for name, value in TINY.items()}

        def reports(*arguments: object, given: bytes | None = None) -> list[dict]:
            command = [LOOKDOWN, "detect", *arguments, "--profile", "fast"]
            done = subprocess.run(command, input=given, env=os.environ | settings, check=True, capture_output=True)
            return [json.loads(line) for line in done.stdout.splitlines()]

        found = reports(clip, "--every", "500ms", "--annotate", out)
        names = [report["request_id"].removeprefix(str(clip)) for report in found]
        self.assertEqual(names, [f"#t={half / 2:.3f}" for half in range(6)])
        probe = ["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames", "-of", "csv=p=0"]
        self.assertEqual(subprocess.run([*probe, out], check=True, capture_output=True).stdout.strip(), b"6")
        piped = reports("-", given=b"".join(self.frames))
        self.assertEqual([report["request_id"] for report in piped], ["-#1", "-#2", "-#3"])
