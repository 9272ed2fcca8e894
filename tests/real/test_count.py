"""`lookdown count` with a real server and a real MQTT broker."""

import base64
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

from cameras import Handler, empty_frame, http_camera, office_calibration, serving
from harness.places import LOOKDOWN, ROOT, SAMPLES
from harness.processes import free_ports
from mosquitto import PASSWORD, USER, broker
from state import metric, wait_until
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent
VERIFIER = ROOT / ".setup" / "real" / "webhooks" / "bin" / "python"
VERIFY = """
import json, sys
from standardwebhooks import Webhook
given = json.load(sys.stdin)
print(json.dumps(Webhook(given["secret"]).verify(given["body"], given["headers"])))
"""
"""Prints the payload of a webhook, and fails for a signature that does not fit."""
SECRET = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw"
OTHER_SECRET = "whsec_QSBzZWNyZXQgdGhhdCBpcyBub3Qgb25l"
OFFICE = (SAMPLES / "office.jpg").read_bytes()
DETECT = "/detect?calibration=office&profile=fast"
FRAMES = 12
KILLS = 6
ZONES = [{"name": "left", "frame_px": [[0, 0], [480, 0], [480, 960], [0, 960]]}]
LINES = [{"name": "middle", "frame_px": [[480, 0], [480, 960]], "directions": ["east", "west"]}]
TOPICS = "lookdown/counts/cameras/office"
LONGEST_GAP = "4s"
"""After this time, topics of unknown cameras are withdrawn."""


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


@contextlib.contextmanager
def webhook_receiver() -> Iterator[tuple[str, list[dict]]]:
    """Receives webhooks. Yields its URL, and the headers and bodies of the requests."""
    received: list[dict] = []

    class Receiver(Handler):
        def do_POST(self):
            """Keeps a request."""
            body = self.rfile.read(int(self.headers["Content-Length"])).decode()
            received.append({"headers": dict(self.headers), "body": body})
            self.send_response(204)
            self.end_headers()

    with serving(Receiver) as port:
        yield f"http://127.0.0.1:{port}/hook", received


def verified(secret: str, message: dict) -> subprocess.CompletedProcess:
    """The verification of a webhook by `standardwebhooks`."""
    command = [VERIFIER, "-c", VERIFY]
    given = json.dumps({"secret": secret, **message})
    return subprocess.run(command, input=given, capture_output=True, text=True, check=False, timeout=60)


class CountedCamera(unittest.TestCase):
    """A server, a broker, and `lookdown count` between them."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        calibrations = office_calibration(self.folder / "calibrations", zones=ZONES, lines=LINES)
        self.broker = self.enterContext(broker(self.folder))
        (self.port,) = free_ports(1)
        server = {"MODEL__PATH": "", "MQTT__URL": self.broker.url, "RESULTS__CAMERA_METRICS": "true"}
        server |= {"RESULTS__IMAGES": "office", "COUNTS__URL": f"http://127.0.0.1:{self.port}"}
        self.server = self.enterContext(lookdown(server, calibrations=calibrations))
        password = self.folder / "password"
        password.write_text(PASSWORD + "\n", encoding="utf-8")
        self.settings, self.store = self.folder / "count.toml", self.folder / "counts.sqlite"
        self.settings.write_text(
            f'[upstream]\nurl = "http://{self.server.address}"\n'
            f'[counts]\nlisten = "127.0.0.1:{self.port}"\n'
            f'path = "{self.store}"\ncommit_every = "200ms"\nlongest_gap = "{LONGEST_GAP}"\n'
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

    def send_frames(self, camera: str = "office") -> int:
        """Sends frames of people who stand, and returns the number of persons of the last report."""
        for _ in range(FRAMES):
            persons = len(json.loads(self.server.post(f"{DETECT}&camera={camera}", OFFICE))["persons"])
            time.sleep(0.1)
        return persons


class Counts(CountedCamera):
    """Counts of a camera."""

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
                {"frame_px", "id", "first_seen", "last_seen", "posture", "posture_probability", "tail", "tail_px"},
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

    def shown_numbers(self, count: Count) -> dict[str, float]:
        """The number of persons of the camera in every place."""
        row = next(row for row in json.loads(self.server.get("/results")) if row["camera"] == "office")
        retained = self.broker.retained()
        return {
            "results": row["persons"],
            "source": row["persons_source"],
            "tracks": len((count.get("/counts/office/tracks") or {"tracks": []})["tracks"]),
            "metrics": metric(self.server, 'camera_persons{camera="office"}'),
            "mqtt": float(retained.get("lookdown/cameras/office/persons", "nan")),
            "counts over mqtt": float(retained.get(f"{TOPICS}/persons", "nan")),
            "frame": row["frame_persons"],
            "frame over mqtt": float(retained.get("lookdown/cameras/office/frame_persons", "nan")),
        }

    def until_one_number(self, count: Count, wanted: float | None = None) -> dict[str, float]:
        """Sends frames until every place shows one number, and returns all numbers."""

        def is_one(numbers: dict[str, float]) -> bool:
            places = [numbers[place] for place in ("results", "tracks", "metrics", "mqtt", "counts over mqtt")]
            is_wanted = places[0] > 0 if wanted is None else places[0] == wanted
            return len(set(places)) == 1 and is_wanted and numbers["source"] == "tracks"

        deadline = time.monotonic() + 60
        while not is_one(numbers := self.shown_numbers(count)):
            self.assertLess(time.monotonic(), deadline, (wanted, numbers))
            # Weak persons are in the frame only.
            self.server.post(f"{DETECT}&score_threshold=0.06", OFFICE)
        return numbers

    def decide(self, method: str, thing: int) -> int:
        """Confirms furniture of the camera or takes it back at the server, and returns the status."""
        url = f"http://{self.server.address}/cameras/office/furniture/{thing}"
        try:
            with urllib.request.urlopen(urllib.request.Request(url, method=method), timeout=20) as answer:
                return answer.status
        except urllib.error.HTTPError as error:
            return error.code

    def test_every_place_subtracts_furniture(self):
        with self.counting() as count:
            wait_until(lambda: count.get("/counts") is not None, "lookdown count answers")
            self.server.post(DETECT, OFFICE)
            persons = self.until_one_number(count)["results"]
            deadline = time.monotonic() + 120
            while (status := self.decide("PUT", 1)) != 204:
                self.assertEqual(404, status)
                self.assertLess(time.monotonic(), deadline, "nothing that stands for 30 s")
                self.server.post(DETECT, OFFICE)
            self.until_one_number(count, persons - 1)
            things = json.loads(self.server.get("/cameras/office/furniture"))
            states = {thing["id"]: (thing["state"], len(thing["outline_px"])) for thing in things}
            self.assertEqual(("confirmed", 4), states[1])
            count.stop(signal.SIGKILL)
        with self.counting() as count:
            wait_until(lambda: count.get("/counts") is not None, "lookdown count answers again")
            self.until_one_number(count, persons - 1)
            self.assertEqual(204, self.decide("DELETE", 1))
            self.until_one_number(count, persons)
            self.assertEqual(404, self.decide("DELETE", 1))

    def test_every_place_shows_one_number(self):
        with self.counting() as count:
            wait_until(lambda: count.get("/counts") is not None, "lookdown count answers")
            self.server.post(DETECT, OFFICE)
            numbers = self.until_one_number(count)
            self.assertGreater(numbers["frame"], numbers["results"])
            self.assertEqual(numbers["frame"], numbers["frame over mqtt"])
            name = "homeassistant/sensor/lookdown_office_frame_persons/config"
            config = json.loads(self.broker.retained()[name])
            self.assertIs(False, config["enabled_by_default"])
            count.stop(signal.SIGKILL)
        self.server.delete("/results/office")
        self.server.post(DETECT, OFFICE)
        source = lambda: json.loads(self.server.get("/results"))[0]["persons_source"]  # noqa: E731
        wait_until(lambda: source() == "median", "the number of the counts has expired")
        self.server.delete("/results/office")
        last = [len(json.loads(self.server.post(DETECT, OFFICE))["persons"]) for _ in range(3)]
        rows = json.loads(self.server.get("/results"))
        self.assertEqual([(last[-1], "median")], [(row["persons"], row["persons_source"]) for row in rows])

    def test_topics_of_cameras_removed_while_down_are_withdrawn(self):
        def topics_of(camera: str) -> list[str]:
            names = (f"/counts/cameras/{camera}/", f"_{camera}_count_")
            return [topic for topic in self.broker.retained() if any(name in topic for name in names)]

        with self.counting() as count:
            wait_until(lambda: count.get("/counts") is not None, "lookdown count answers")
            self.send_frames()
            wait_until(lambda: f"{TOPICS}/lines/middle/east" in self.broker.retained(), "the broker has the line")
            self.assertGreater(len(topics_of("office")), 10)
            count.stop(signal.SIGKILL)
        for path in self.folder.glob("counts.sqlite*"):
            path.unlink()
        # A new store begins with the reports that the server still has.
        self.server.delete("/results/office")
        # A line of a camera that goes on is gone as well.
        removed = [
            "lookdown/counts/cameras/hall/lines/old/in",
            "homeassistant/sensor/lookdown_hall_count_line_old_in/config",
        ]
        for topic in removed:
            self.broker.client("pub", "-r", "-m", "{}", "-t", topic)
        with self.counting() as count:
            wait_until(lambda: count.get("/counts") is not None, "lookdown count answers again")
            unavailable = lambda: self.broker.retained().get(f"{TOPICS}/availability") == "offline"
            wait_until(unavailable, "the unknown camera is unavailable")
            self.send_frames("hall")
            wait_until(lambda: not topics_of("office"), "the topics of the removed camera are withdrawn")
            retained = self.broker.retained()
            for topic in removed:
                self.assertNotIn(topic, retained)
            self.assertIn("lookdown/counts/cameras/hall/lines/middle/east", retained)
            self.assertIn("homeassistant/sensor/lookdown_hall_count_line_middle_east/config", retained)
            self.assertEqual("online", retained["lookdown/counts/status"])

    def test_webhooks_are_verified_by_the_library_of_the_standard(self):
        url, received = self.enterContext(webhook_receiver())
        secret = self.folder / "hook.secret"
        secret.write_text(SECRET + "\n", encoding="utf-8")
        with open(self.settings, "a", encoding="utf-8") as settings:
            settings.write(f'[[webhooks]]\nurl = "{url}"\nsecret_file = "{secret}"\non = "occupancy"\nimage = true\n')
        with self.counting() as count:
            wait_until(lambda: count.get("/counts") is not None, "lookdown count answers")
            self.send_frames()
            message = wait_until(lambda: received and received[0], "a webhook is received")
        right = verified(SECRET, message)
        self.assertEqual(0, right.returncode, right.stderr)
        event = json.loads(right.stdout)
        self.assertEqual("occupancy.reached", event["type"])
        image = event["data"]["image"]
        self.assertEqual("image/jpeg", image["media_type"])
        self.assertTrue(base64.b64decode(image["base64"]).startswith(b"\xff\xd8"))
        changed = message | {"body": message["body"].replace("office", "0ffice")}
        for secret, wrong in ((OTHER_SECRET, message), (SECRET, changed)):
            refused = verified(secret, wrong)
            self.assertNotEqual(0, refused.returncode)
            self.assertIn("WebhookVerificationError", refused.stderr)

    def test_problems_are_one_clear_sentence(self):
        for text, problem in [
            ("[upstream]\nurl = 5\n", "upstream.url"),
            ('[mqtt]\nurl = "http://localhost"\n', "mqtt.url"),
            ('[counts]\npath = "/nowhere/counts.sqlite"\n', "counts.path: /nowhere/counts.sqlite cannot be used"),
        ]:
            with self.subTest(problem):
                self.settings.write_text(text, encoding="utf-8")
                command = [LOOKDOWN, "count", self.settings, "--listen", f"127.0.0.1:{self.port}"]
                ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=20)
                self.assertEqual(1, ended.returncode)
                self.assertIn(problem, ended.stderr)


class KilledRun(unittest.TestCase):
    """`lookdown run` with a camera, killed at any time."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.calibrations = office_calibration(self.folder / "calibrations", zones=ZONES, lines=LINES)
        # Persons appear in the zone and are gone again, every twelve seconds.
        self.camera = self.enterContext(http_camera([empty_frame()] * 24 + [OFFICE] * 24, 4.0))

    @contextlib.contextmanager
    def run_all(self):
        """Runs all parts, and kills them at the end."""
        settings = {
            "COUNTS__PATH": self.folder / "counts.sqlite",
            "COUNTS__COMMIT_EVERY": "500ms",
            "STATE__PATH": self.folder / "state",
        }
        source = f"http://127.0.0.1:{self.camera}/stream"
        command = ["run", source, "--name", "hall", "--calibration", "office", "--profile", "fast", "--every", "250ms"]
        with lookdown(settings, calibrations=self.calibrations, command=command) as server:
            yield server
            os.kill(server.pid, signal.SIGKILL)
            server.process.wait(10)

    def shown(self, server) -> tuple[float, float]:
        """The entries into zones and the time with reports that a client sees."""
        try:
            counts = json.loads(server.get("/counts/hall?step=1h"))
        except urllib.error.HTTPError:
            # The counts are being started, or there is no report yet.
            return (0, 0)
        metrics = server.get("/metrics").decode().splitlines()
        entries = [line for line in metrics if line.startswith("lookdown_count_zone_entries_total{")]
        known = sum(step["known_seconds"] for step in counts["steps"])
        return (sum(float(line.split()[-1]) for line in entries), known)

    def test_a_kill_loses_no_count_that_was_shown(self):
        shown = (0.0, 0.0)
        for kill in range(KILLS):
            with self.run_all() as server:
                resumed = wait_until(lambda server=server: any(self.shown(server)) and self.shown(server), "counts", 60)
                self.assertGreaterEqual(resumed, shown, f"kill {kill}")
                self.assertGreaterEqual(resumed[1], shown[1], f"kill {kill}")
                # Not a multiple of the interval of the transactions.
                until = time.monotonic() + 3.0 + 0.37 * kill
                while time.monotonic() < until:
                    shown = self.shown(server)
        self.assertGreater(shown[0], 0)
        print(f"after {KILLS} kills: {shown[0]:.0f} entries, {shown[1]:.0f} s with reports", flush=True)


if __name__ == "__main__":
    unittest.main()
