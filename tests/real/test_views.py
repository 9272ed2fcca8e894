"""Straight live views of `lookdown run` and `serve`: their delay, many viewers, and players that read them by URL."""

import contextlib
import hashlib
import http.client
import json
import subprocess
import tempfile
import threading
import time
import unittest
import urllib.request
from collections.abc import Iterator
from pathlib import Path

from cameras import CLOCK_BITS, http_camera, office_calibration, rtsp_clock, shown_milliseconds
from harness.places import SAMPLES
from harness.processes import Server
from harness.usage import usage_of
from state import wait_until
from support.lookdown import DETECT, TINY, lookdown

OFFICE = (SAMPLES / "office.jpg").read_bytes()
RATE = 10
"""Frames per second of the cameras."""
DELAY_FRAMES = 100
DELAY_MILLIS = 500
"""Longest delay of 95 % of the frames. On an idle machine it is below 120 ms; tests share theirs."""
VIEWERS = 50
WATCHED_SECONDS = 10.0
MEMORY_BYTES = 64 << 20
"""Memory that the viewers may take."""
CPU_RATIO = 5.0
"""CPU time with all viewers and with one. A rendering for each would take more than ten times as much."""
KEY, SENDER = "lookdown_views", "lookdown_sender"
FOCAL_PX = 2000.0
CLOCK = {
    "image": {"width": 32 * CLOCK_BITS, "height": 384},
    "lens": {"model": "equidistant", "focal": FOCAL_PX, "max_theta": 0.3, "cx": 16 * CLOCK_BITS - 0.5, "cy": 191.5},
    "mount": {"world_up": [0.0, 0.0, -1.0], "height_m": 3.0},
}
"""A long lens, whose straight view is nearly its frame."""
CLOCK_VIEW = {"azimuth_deg": 270, "tilt_deg": 0, "field_of_view_deg": 22, "width": 32 * CLOCK_BITS, "height": 384}


def put(server: Server, path: str, values: dict) -> None:
    """Stores a view."""
    body = json.dumps(values).encode()
    request = urllib.request.Request(f"http://{server.address}{path}", body, method="PUT")
    with urllib.request.urlopen(request, timeout=60):
        pass


def parts(server: Server, path: str) -> Iterator[bytes]:
    """The images of an MJPEG stream."""
    connection = http.client.HTTPConnection(server.address, timeout=60)
    connection.request("GET", path)
    with contextlib.closing(connection), connection.getresponse() as stream:
        assert stream.status == 200, stream.read()
        while line := stream.readline():
            if line.lower().startswith(b"content-length:"):
                stream.readline()
                yield stream.read(int(line.split(b":")[1]))


class Views(unittest.TestCase):
    """Views as their viewers get them."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.settings = TINY | {"STATE__PATH": self.folder / "state", "COUNTS__PATH": self.folder / "counts.sqlite"}

    def run_camera(self, source: str, calibrations: Path, calibration: str):
        """Runs Lookdown with the camera `hall`."""
        camera = ["--name", "hall", "--calibration", calibration, "--profile", "fast", "--every", "1s"]
        return lookdown(self.settings, command=["run", source, *camera], calibrations=calibrations)

    def test_views_show_each_frame_soon(self):
        calibrations = self.folder / "calibrations"
        calibrations.mkdir()
        (calibrations / "clock.json").write_text(json.dumps({"id": "clock"} | CLOCK), encoding="utf-8")
        with (
            rtsp_clock(RATE) as port,
            self.run_camera(f"rtsp://127.0.0.1:{port}/stream", calibrations, "clock") as server,
        ):
            put(server, "/cameras/hall/views/front", CLOCK_VIEW)
            wait_until(lambda: json.loads(server.get("/results")), "there is a report", 60)
            shown = []
            for image in parts(server, "/cameras/hall/views/front.mjpg"):
                shown.append((time.time_ns() // 1_000_000, image))
                # The camera starts to deliver all frames with its first viewer.
                if len(shown) == DELAY_FRAMES + 3 * RATE:
                    break
        shown = shown[3 * RATE :]
        delays = sorted((now - shown_milliseconds(image)) % 2**CLOCK_BITS for now, image in shown)
        middle, high = delays[len(delays) // 2], delays[len(delays) * 95 // 100]
        seconds = (shown[-1][0] - shown[0][0]) / 1000
        print(
            f"\ndelay of {len(delays)} frames: median {middle} ms, 95 % {high} ms; {len(shown) / seconds:.1f} frames/s"
        )
        self.assertLess(high, DELAY_MILLIS)

    def test_many_viewers_cost_one_rendering(self):
        calibrations = office_calibration(self.folder / "calibrations")
        with (
            http_camera([OFFICE], RATE) as camera,
            self.run_camera(f"http://127.0.0.1:{camera}/stream", calibrations, "office") as server,
        ):
            put(server, "/cameras/hall/views/door", {})
            wait_until(lambda: json.loads(server.get("/results")), "there is a report", 60)
            counts, ended = [], threading.Event()

            def watch() -> None:
                counts.append(0)
                viewer = len(counts) - 1
                for _ in parts(server, "/cameras/hall/views/door.mjpg"):
                    counts[viewer] += 1
                    if ended.is_set():
                        return

            def watched() -> tuple[float, int]:
                """CPU seconds per second, and resident bytes, with the viewers there are."""
                time.sleep(2.0)
                before = usage_of(server.pid)
                time.sleep(WATCHED_SECONDS)
                after = usage_of(server.pid)
                return (after.cpu_seconds - before.cpu_seconds) / WATCHED_SECONDS, after.resident_bytes

            threads = [threading.Thread(target=watch, daemon=True) for _ in range(VIEWERS)]
            threads[0].start()
            wait_until(lambda: counts and counts[0] > RATE, "the first viewer has frames", 60)
            one, memory_of_one = watched()
            for thread in threads[1:]:
                thread.start()
            wait_until(lambda: len(counts) == VIEWERS and min(counts) > 0, "all viewers have frames", 60)
            many, memory_of_many = watched()
            ended.set()
            for thread in threads:
                thread.join()
        more = memory_of_many - memory_of_one
        print(
            f"\ncores: {one:.3f} for one viewer, {many:.3f} for {VIEWERS}; "
            f"memory {memory_of_one >> 20} MiB and {more >> 20} MiB more; fewest frames of a viewer {min(counts)}"
        )
        self.assertLess(many, CPU_RATIO * one)
        self.assertLess(more, MEMORY_BYTES)

    def test_a_player_reads_a_view_with_a_key_in_its_url(self):
        digests = [hashlib.sha256(key.encode()).hexdigest() for key in (KEY, SENDER)]
        keys = {"ACCESS__KEYS": "wall:view:{},sender:detect:{}".format(*digests)}
        calibrations = office_calibration(self.folder / "calibrations")
        with lookdown(self.settings, calibrations=calibrations) as server:
            put(server, "/cameras/office/views/door", {"width": 640, "height": 480})
        with lookdown(self.settings | keys, calibrations=calibrations) as server:
            ended = threading.Event()

            def send() -> None:
                while not ended.wait(1.0 / RATE):
                    headers = {"X-API-Key": SENDER}
                    request = urllib.request.Request(f"http://{server.address}{DETECT}", OFFICE, headers)
                    urllib.request.urlopen(request, timeout=60).close()

            threading.Thread(target=send, daemon=True).start()
            url = f"http://any:{KEY}@{server.address}/cameras/office/views/door.mjpg"
            # As go2rtc calls it for `ffmpeg:URL#video=h264`.
            coded = ["-c:v", "libx264", "-preset", "superfast", "-tune", "zerolatency", "-frames:v", "5"]
            command = ["ffmpeg", "-v", "error", "-i", url, *coded, "-f", "mpegts", self.folder / "view.ts"]
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
            ended.set()
            self.assertEqual(done.returncode, 0, done.stderr)
        probe = ["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=codec_name,width,nb_read_frames"]
        found = subprocess.run(
            [*probe, "-of", "csv=p=0", self.folder / "view.ts"], capture_output=True, text=True, check=True
        )
        self.assertEqual(found.stdout.split()[0].split(",")[:3], ["h264", "640", "5"])


if __name__ == "__main__":
    unittest.main()
