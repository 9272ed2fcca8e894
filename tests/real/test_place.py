"""Two cameras over one floor: `lookdown run` follows the people of both, and `lookdown calibration place` places one.

Both show the rendered walks. The second one hangs at the same place, turned by a quarter.
"""

import json
import subprocess
import tempfile
import unittest
import urllib.error
from pathlib import Path

from cameras import http_camera
from harness.places import LOOKDOWN
from harness.processes import Server
from state import wait_until
from support.lookdown import lookdown

CLIP = Path(__file__).resolve().parent / "walks"
CAMERAS = {"hall": "null", "lobby": "transpose=1"}
"""The cameras, and the filter of ffmpeg for their frames: the second one is turned clockwise."""
YAW_DEG = -90
RATE = 5


def tracks(server: Server, name: str) -> list[dict]:
    """The tracks of a camera; none before its first report."""
    try:
        return json.loads(server.get(f"/counts/{name}/tracks"))["tracks"]
    except urllib.error.HTTPError:
        return []


class Place(unittest.TestCase):
    """The place of the second camera on the floor of the first one."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        calibration = json.loads((CLIP / "calibration.json").read_text(encoding="utf-8"))
        (self.folder / "calibrations").mkdir()
        for name, turned in CAMERAS.items():
            own = {key: value for key, value in calibration.items() if key != "lines"} | {"id": name}
            (self.folder / "calibrations" / f"{name}.json").write_text(json.dumps(own), encoding="utf-8")
            (self.folder / name).mkdir()
            frames = ["-vf", turned, "-q:v", "2", "-start_number", "0", self.folder / name / "%d.jpg"]
            subprocess.run(["ffmpeg", "-v", "error", "-i", CLIP / "walks.mp4", *frames], check=True)

    def camera(self, name: str) -> int:
        """The port of a camera. Both show the same moment."""
        count = len(list((self.folder / name).iterdir()))
        frames = [(self.folder / name / f"{number}.jpg").read_bytes() for number in range(count)]
        return self.enterContext(http_camera(frames, RATE))

    def settings(self) -> Path:
        """The settings of both cameras."""
        cameras = [
            f'[[cameras]]\nname = "{name}"\nurl = "http://127.0.0.1:{self.camera(name)}/stream"\n'
            f'calibration = "{name}"\nprofile = "fast"\nevery = "400ms"\n'
            for name in CAMERAS
        ]
        file = self.folder / "lookdown.toml"
        file.write_text("".join(cameras), encoding="utf-8")
        return file

    def test_a_turned_camera_at_the_same_place_is_placed(self):
        settings = {"COUNTS__PATH": self.folder / "counts.sqlite", "STATE__PATH": self.folder / "state"}
        command = ["run", self.settings()]
        with lookdown(settings, calibrations=self.folder / "calibrations", command=command) as process:
            wait_until(lambda: all(tracks(process, name) for name in CAMERAS), "both cameras have tracks")
            place = [LOOKDOWN, "calibration", "place", *CAMERAS, "--minutes", "1"]
            place += ["--server", f"http://{process.address}"]
            placed = subprocess.run(place, capture_output=True, text=True, timeout=120)
        print(placed.stdout, placed.stderr, flush=True)
        self.assertEqual(placed.returncode, 0, placed.stderr)
        place = json.loads(placed.stdout)
        self.assertLess(max(map(abs, place["mount"]["position_m"])), 0.15)
        self.assertLess(abs(place["mount"]["yaw_deg"] - YAW_DEG), 2)
        self.assert_is_checked(place)

    def assert_is_checked(self, place: dict) -> None:
        """Fails if the calibration with its place on a site does not have the sources of the place."""
        calibration = json.loads((self.folder / "calibrations" / "lobby.json").read_text(encoding="utf-8"))
        mount = calibration["mount"] | place["mount"] | {"site": "floor"}
        file = self.folder / "placed.json"
        file.write_text(json.dumps(calibration | place | {"mount": mount}), encoding="utf-8")
        checked = subprocess.run([LOOKDOWN, "calibration", "check", file], capture_output=True, text=True, check=True)
        self.assertRegex(checked.stdout, r"position_m: from_people ± \d")
