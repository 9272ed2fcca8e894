"""The web page in Debian's Chromium, driven by Playwright, and its calculations in Node.

`LOOKDOWN_PAGE_IMAGES=docs/images make real PARTS=page` updates the screenshots in docs/images.
"""

import base64
import contextlib
import hashlib
import json
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import unittest
from collections.abc import Iterator
from pathlib import Path

from cameras import Handler, serving
from harness.processes import Server, free_ports
from mosquitto import Broker
from rendered_room import rendered_room
from state import PATIENCE_SECONDS
from support.exchange import ask
from support.lookdown import lookdown
from support.places import FIXTURES, ROOT, SAMPLES
from test_count import Count

HERE = Path(__file__).resolve().parent / "page"
KEY = "a key that only this test knows"
CAMERAS_WITH_IMAGES = "gate,office,canteen,lounge"
"""Cameras whose images are kept."""
OFFICE = (SAMPLES / "office.jpg").read_bytes()
ROOM = rendered_room()
WALKS = HERE.parent / "walks"
FALL = HERE.parent / "fall"
"""Composed by the generator of lab/training, of a room and clothes that training never had."""
JPEG = b"\xff\xd8"
"""How a JPEG file begins."""
STILL_SECONDS = 2.0
"""Interval of the frames in which everyone stands still."""
ZONE = {"name": "middle", "floor_m": [[-2, -1], [2, -1], [2, 3], [-2, 3]]}


class Camera(Handler):
    """A camera with snapshots for the user `viewer`. The URL has a query that belongs to it."""

    def do_GET(self) -> None:
        login = base64.b64encode(f"viewer:{KEY}".encode()).decode()
        is_allowed = self.headers.get("Authorization") == f"Basic {login}"
        images = {"/snapshot.jpg?token=1": OFFICE, "/room.png": ROOM}
        is_found = self.path in images
        status = 200 if is_allowed and is_found else 404 if is_allowed else 401
        challenge = ("WWW-Authenticate", 'Basic realm="camera"')
        self.answer(status, images[self.path] if status == 200 else b"", challenge, ("Content-Type", "image/jpeg"))


class Fall(Handler):
    """A camera below which someone walks in 8 frames, and then lies on the floor."""

    frames: list[bytes]

    def do_GET(self) -> None:
        # A slow server misses no step.
        frame = self.frames.pop(0) if len(self.frames) > 1 else self.frames[0]
        self.answer(200, frame, ("Content-Type", "image/jpeg"))


class Page(unittest.TestCase):
    """The actions and views of a visitor."""

    @classmethod
    def setUpClass(cls) -> None:
        """Installs the browser driver according to the lock file."""
        environment = os.environ | {"PLAYWRIGHT_SKIP_BROWSER_DOWNLOAD": "1"}
        subprocess.run(
            ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error"],
            cwd=HERE,
            env=environment,
            check=True,
        )

    def test_the_calculations_of_the_page(self) -> None:
        self.run_node("maths.test.js", {})
        self.run_node("areas.test.js", {})

    def test_the_page_in_a_browser(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            calibrations = Path(folder) / "calibrations"
            shutil.copytree(SAMPLES / "calibrations", calibrations)
            keys = Path(folder) / "keys.toml"
            digest = hashlib.sha256(KEY.encode()).hexdigest()
            keys.write_text(
                f'page = {{ scopes = ["detect", "read", "admin"], sha256 = "{digest}" }}\n', encoding="utf-8"
            )
            settings = {"RESULTS__IMAGES": CAMERAS_WITH_IMAGES}
            with lookdown(settings, calibrations=calibrations) as server:
                with (
                    lookdown({"ACCESS__KEYS_FILE": str(keys)}) as keyed,
                    self.counted(Path(folder)) as counted,
                    self.with_a_camera(Path(folder)) as camera,
                    self.with_a_fall(Path(folder)) as fall,
                ):
                    self.run_node(
                        "all.test.js",
                        {
                            "LOOKDOWN_URL": f"http://{server.address}",
                            "LOOKDOWN_KEYED_URL": f"http://{keyed.address}",
                            "LOOKDOWN_KEY": KEY,
                            "LOOKDOWN_SAMPLES": str(SAMPLES),
                            "LOOKDOWN_FIXTURES": str(FIXTURES / "calibrations"),
                            **counted,
                            **camera,
                            "LOOKDOWN_FALL_URL": f"http://{fall.address}",
                        },
                    )

    @contextlib.contextmanager
    def counted(self, folder: Path) -> Iterator[dict[str, str]]:
        """A server that forwards to `lookdown count`, one whose counts are gone, and frames of a walk.

        Yields variables of the tests.
        """
        calibrations, frames = folder / "counted", folder / "walk"
        calibrations.mkdir()
        frames.mkdir()
        calibration = json.loads((WALKS / "calibration.json").read_text(encoding="utf-8"))
        (calibrations / "walks.json").write_text(json.dumps(calibration | {"zones": [ZONE]}), encoding="utf-8")
        clip = ["-i", WALKS / "walks.mp4", "-q:v", "2", frames / "%d.jpg"]
        subprocess.run(["ffmpeg", "-v", "error", *clip], check=True)
        port, closed_port = free_ports(2)
        settings = folder / "count.toml"
        uncounted_settings = {"COUNTS__URL": f"http://127.0.0.1:{closed_port}"}
        server_settings = {"COUNTS__URL": f"http://127.0.0.1:{port}", "RESULTS__IMAGES": "hall"}
        with lookdown(server_settings, calibrations=calibrations) as server, lookdown(uncounted_settings) as uncounted:
            settings.write_text(
                f'[upstream]\nurl = "http://{server.address}"\n[counts]\nlisten = "127.0.0.1:{port}"\n'
                f'path = "{folder / "counts.sqlite"}"\nlongest_gap = "10m"\n',
                encoding="utf-8",
            )
            count = Count(settings, folder / "count.log", port)
            ended = threading.Event()
            shop = threading.Thread(target=self.stand_still, args=(server.address, frames / "1.jpg", ended))
            shop.start()
            try:
                yield {
                    "LOOKDOWN_COUNTED_URL": f"http://{server.address}",
                    "LOOKDOWN_UNCOUNTED_URL": f"http://{uncounted.address}",
                    "LOOKDOWN_WALK": str(frames),
                    "LOOKDOWN_WALK_TRUTH": str(WALKS / "truth.json"),
                }
            finally:
                ended.set()
                shop.join()
                count.stop(signal.SIGKILL)

    def stand_still(self, address: str, frame: Path, ended: threading.Event) -> None:
        """Sends the same frame as the camera `shop`, in which everyone stands still, until the tests end."""
        query = "calibration=walks&camera=shop&profile=fast"
        while not ended.wait(STILL_SECONDS):
            ask(address, "POST", f"/detect?{query}", frame.read_bytes())

    @contextlib.contextmanager
    def with_a_camera(self, folder: Path) -> Iterator[dict[str, str]]:
        """A `lookdown run` without cameras, one with a camera of its settings, and a camera with a user.

        Yields variables of the tests.
        """
        runs = folder / "run"
        runs.mkdir()
        settings = {
            "STATE__PATH": runs / "state",
            "COUNTS__PATH": runs / "counts.sqlite",
            "DETECT__PROFILE": "fast",
            "LOG__FILTER": "warn",
        }
        others = {"STATE__PATH": runs / "others", "COUNTS__PATH": runs / "others.sqlite"}
        with serving(Camera) as camera:
            with_camera = ["run", f"http://127.0.0.1:{camera}/snapshot.jpg", "--name", "gate"]
            with (
                lookdown(settings, calibrations=runs, command=["run"]) as run,
                lookdown(settings | others, calibrations=runs, command=with_camera) as settings_run,
            ):
                yield {
                    "LOOKDOWN_RUN_URL": f"http://{run.address}",
                    "LOOKDOWN_SETTINGS_RUN_URL": f"http://{settings_run.address}",
                    "LOOKDOWN_CAMERA_URL": f"http://127.0.0.1:{camera}",
                    "LOOKDOWN_CAMERA_PASSWORD": KEY,
                }

    @contextlib.contextmanager
    def with_a_fall(self, folder: Path) -> Iterator[Server]:
        """A `lookdown run` whose camera shows a fall, with an alert after 5 s and its image over MQTT."""
        broker = Broker(folder)
        broker.start()
        self.addCleanup(broker.stop)
        topic = ["-t", "lookdown/counts/floor_alert_images/room", "-C", "1"]
        images = subprocess.Popen(["mosquitto_sub", *broker.login(), *topic], stdout=subprocess.PIPE)
        self.addCleanup(images.kill)
        calibrations, frames = folder / "fall", folder / "fall_frames"
        frames.mkdir()
        calibrations.mkdir()
        shutil.copy(FALL / "calibration.json", calibrations / "room.json")
        clip = ["-i", FALL / "fall.mp4", "-q:v", "2", frames / "%02d.jpg"]
        subprocess.run(["ffmpeg", "-v", "error", *clip], check=True)
        Fall.frames = [frame.read_bytes() for frame in sorted(frames.iterdir())]
        settings = {
            "STATE__PATH": folder / "fall_state",
            "COUNTS__PATH": folder / "fall.sqlite",
            "RESULTS__IMAGES": "room",
            "MQTT__URL": broker.url,
            "MQTT__IMAGE_EVERY_SECONDS": "1",
            "COUNTS__FLOOR_ALERT": "true",
            "COUNTS__FLOOR_ALERT_AFTER": "5s",
            "LOG__FILTER": "warn",
        }
        options = ["--name", "room", "--calibration", "room", "--profile", "fast", "--every", "1s"]
        with serving(Fall) as camera:
            command = ["run", f"http://127.0.0.1:{camera}/", *options]
            with lookdown(settings, calibrations=calibrations, command=command) as run:
                yield run
                image, _ = images.communicate(timeout=PATIENCE_SECONDS)
                self.assertTrue(image.startswith(JPEG), "the image of the alert")

    def run_node(self, tests: str, settings: dict[str, str]) -> None:
        """Runs tests that are written in JavaScript."""
        screenshots = os.environ.get("LOOKDOWN_PAGE_IMAGES")
        if screenshots:
            settings = settings | {"LOOKDOWN_PAGE_IMAGES": str(ROOT / screenshots)}
        done = subprocess.run(["node", "--test", tests], cwd=HERE, env=os.environ | settings, check=False)
        self.assertEqual(done.returncode, 0, f"{tests}: see above")


if __name__ == "__main__":
    unittest.main()
