"""`lookdown count` with a real server and a real MQTT broker."""

import contextlib
import json
import os
import signal
import subprocess
import tempfile
import time
import unittest
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

from harness.places import LOOKDOWN, SAMPLES
from harness.processes import free_ports
from mosquitto import PASSWORD, USER, broker
from support.lookdown import lookdown
from waiting import wait_until

OFFICE = (SAMPLES / "office.jpg").read_bytes()
DETECT = "/detect?calibration=office&profile=fast"
FRAMES = 12
ZONES = [{"name": "left", "frame_px": [[0, 0], [480, 0], [480, 960], [0, 960]]}]
LINES = [{"name": "middle", "frame_px": [[480, 0], [480, 960]], "directions": ["east", "west"]}]
TOPICS = "lookdown/counts/cameras/office"


class Count:
    """A running `lookdown count` with its log."""

    def __init__(self, settings: Path, log: Path, port: int):
        self.log, self.url = log, f"http://127.0.0.1:{port}"
        with open(log, "ab") as output:
            command = [LOOKDOWN, "count", settings]
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=output)

    def get(self, path: str) -> dict | list | None:
        """The JSON of a path; `None` while there is none."""
        with contextlib.suppress(OSError), urllib.request.urlopen(self.url + path, timeout=5) as answer:
            return json.loads(answer.read())
        return None

    def stop(self, number: int = signal.SIGTERM) -> int:
        """Stops it, and returns its exit status."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.process.pid, number)
        return self.process.wait(timeout=20)


class Counts(unittest.TestCase):
    """Counts of a camera."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        calibration = json.loads((SAMPLES / "calibrations" / "office.json").read_text(encoding="utf-8"))
        calibrations = self.folder / "calibrations"
        calibrations.mkdir()
        calibration |= {"zones": ZONES, "lines": LINES}
        (calibrations / "office.json").write_text(json.dumps(calibration), encoding="utf-8")
        self.broker = self.enterContext(broker(self.folder))
        self.server = self.enterContext(lookdown({"MODEL__PATH": ""}, calibrations=calibrations))
        (self.port,) = free_ports(1)
        password = self.folder / "password"
        password.write_text(PASSWORD + "\n", encoding="utf-8")
        self.settings = self.folder / "count.toml"
        self.settings.write_text(
            f'[server]\nurl = "http://{self.server.address}"\n'
            f'[http]\nlisten = "127.0.0.1:{self.port}"\n'
            f'[store]\npath = "{self.folder / "counts.sqlite"}"\ncommit_every = "200ms"\n'
            f'[mqtt]\nurl = "mqtt://{USER}@localhost:{self.broker.port}"\npassword_file = "{password}"\n',
            encoding="utf-8",
        )

    @contextlib.contextmanager
    def counting(self) -> Iterator[Count]:
        """Runs `lookdown count` against the server of the test."""
        count = Count(self.settings, self.folder / "count.log", self.port)
        try:
            yield count
        except AssertionError as error:
            raise AssertionError(f"{error}\n{count.log.read_text(encoding='utf-8')}") from None
        finally:
            count.stop(signal.SIGKILL)

    def send_frames(self) -> int:
        """Sends frames of people who stand, and returns the number of persons of the last report."""
        for _ in range(FRAMES):
            persons = len(json.loads(self.server.post(DETECT, OFFICE))["persons"])
            time.sleep(0.1)
        return persons

    def known_seconds(self, count: Count) -> float:
        """The time with reports of the last hour."""
        counts = count.get("/counts/office?step=1h") or {"steps": []}
        return sum(step["known_seconds"] for step in counts["steps"])

    def test_persons_are_counted_published_and_kept_through_a_kill(self):
        with self.counting() as count:
            wait_until(lambda: count.get("/counts") is not None, "lookdown count answers")
            persons = self.send_frames()
            self.assertGreater(persons, 0)
            tracks = wait_until(lambda: (count.get("/counts/office/tracks") or {}).get("tracks"), "there are tracks")
            self.assertLessEqual(abs(len(tracks) - persons), 2)
            self.assertEqual(
                {"frame_px", "id", "first_seen", "last_seen", "tail", "tail_px"},
                set(tracks[0]) - {"floor_m", "velocity_m_s"},
            )
            wait_until(
                lambda: self.broker.retained().get(f"{TOPICS}/persons") == str(len(tracks)), "the broker has them"
            )
            retained = self.broker.retained()
            self.assertEqual("online", retained["lookdown/counts/status"])
            self.assertEqual("0", retained[f"{TOPICS}/lines/middle/east"])
            config = json.loads(retained["homeassistant/sensor/lookdown_office_count_line_middle_east/config"])
            self.assertEqual("total_increasing", config["state_class"])
            before = wait_until(lambda: self.known_seconds(count), "the counts are stored")
            count.stop(signal.SIGKILL)
        wait_until(
            lambda: self.broker.retained().get("lookdown/counts/status") == "offline", "the will is published", 60
        )
        self.send_frames()
        with self.counting() as count:
            more = wait_until(
                lambda: self.known_seconds(count) > before and self.known_seconds(count), "the counts continue"
            )
            self.assertGreater(more, before)
            self.assertEqual(0, count.stop())
        self.assertIn("continuing after the report of", (self.folder / "count.log").read_text(encoding="utf-8"))

    def test_problems_are_one_clear_sentence(self):
        for text, problem in [
            ("[server]\nurl = 5\n", "server.url"),
            ('[mqtt]\nurl = "http://localhost"\n', "mqtt.url"),
            ('[store]\npath = "/nowhere/counts.sqlite"\n', "store.path: /nowhere/counts.sqlite cannot be used"),
        ]:
            with self.subTest(problem):
                self.settings.write_text(text, encoding="utf-8")
                command = [LOOKDOWN, "count", self.settings, "--listen", f"127.0.0.1:{self.port}"]
                ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=20)
                self.assertEqual(1, ended.returncode)
                self.assertIn(problem, ended.stderr)


if __name__ == "__main__":
    unittest.main()
