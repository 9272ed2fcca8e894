"""Lookdown with Home Assistant and mosquitto: the entities of cameras, zones and counts."""

import contextlib
import json
import os
import re
import signal
import subprocess
import tempfile
import unittest
from collections.abc import Iterator
from pathlib import Path

from cameras import empty_frame, http_camera, office_calibration
from harness.places import ROOT, SAMPLES
from mosquitto import PASSWORD, USER, Broker, broker
from state import wait_until
from support.lookdown import lookdown
from test_count import CountedCamera
from test_views import put

HERE = Path(__file__).resolve().parent
PYTHON = ROOT / ".setup" / "real" / "home_assistant" / "bin" / "python"
RECIPES = ROOT / "docs" / "home-automation.md"
CARD = ROOT / "docs" / "examples" / "home_assistant_card.yaml"
OFFICE = (SAMPLES / "office.jpg").read_bytes()
DETECT = "/detect?calibration=office&profile=fast"
NO_PERSONS = f"{DETECT}&score_threshold=1"
PERSONS = "lookdown_office_persons"
OCCUPANCY = "lookdown_office_occupancy"
LEFT = "lookdown_office_zone_left"
VIEW = "lookdown_office_view_door"
LEFT_OCCUPANCY = f"{LEFT}_occupancy"
ENTITIES = {PERSONS, OCCUPANCY, LEFT, LEFT_OCCUPANCY}
LEFT_HALF = {"name": "left", "frame_px": [[0, 0], [480, 0], [480, 960], [0, 960]]}
PAGE = "http://lookdown.local:8080/"
START_SECONDS = 60.0
EXPIRE_SECONDS = 6
STALE_SECONDS = EXPIRE_SECONDS + 15.0


class HomeAssistant:
    """A Home Assistant whose state is in a folder."""

    def __init__(self, folder: Path, of: Broker):
        self.folder, self.broker, self.process = folder, of, None
        folder.mkdir(exist_ok=True)

    def start(self) -> None:
        """Starts it and waits until it writes its states."""
        (self.folder / "states.json").unlink(missing_ok=True)
        script = HERE / "home_assistant_core.py"
        command = [PYTHON, script, self.folder, str(self.broker.port), USER, PASSWORD]
        with (self.folder / "output.log").open("ab") as log:
            self.process = subprocess.Popen(command, stdout=log, stderr=log)
        wait_until((self.folder / "states.json").exists, "Home Assistant has started", START_SECONDS)

    def stop(self) -> None:
        """Stops it."""
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(timeout=START_SECONDS)

    def shown(self) -> dict:
        """Everything that it has written."""
        return json.loads((self.folder / "states.json").read_text(encoding="utf-8"))

    def entities(self) -> dict[str, dict]:
        """The entities by their unique IDs."""
        return {name: entity for name, entity in self.shown().items() if name not in ("notifications", "images")}

    def press(self, entity: str, service: str) -> None:
        """Turns a switch: `turn_on` or `turn_off`."""
        unfinished = self.folder / "press.part"
        unfinished.write_text(json.dumps({"entity": entity, "service": service}), encoding="utf-8")
        unfinished.replace(self.folder / "press.json")

    def state(self, unique_id: str) -> str | None:
        """The state of an entity."""
        return self.entities().get(unique_id, {}).get("state")

    def until(self, wanted: dict[str, str], seconds: float = 30.0) -> None:
        """Waits until the entities have these states."""
        try:
            wait_until(lambda: all(self.state(name) == state for name, state in wanted.items()), "", seconds)
        except AssertionError:
            raise AssertionError(f"{wanted} is not in {json.dumps(self.entities(), indent=1)}") from None


@contextlib.contextmanager
def home_assistant(folder: Path, of: Broker) -> Iterator[HomeAssistant]:
    """A Home Assistant that is connected to the broker, and is stopped at the end."""
    started = HomeAssistant(folder, of)
    try:
        started.start()
        yield started
    finally:
        started.stop()


class Entities(unittest.TestCase):
    """Entities as Home Assistant shows them."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.calibrations = office_calibration(self.folder / "calibrations", zones=[LEFT_HALF])
        self.broker = self.enterContext(broker(self.folder))
        self.home = self.enterContext(home_assistant(self.folder / "home", self.broker))

    def lookdown(self, **settings: str):
        """A server that publishes."""
        own = {
            "MQTT__URL": self.broker.url,
            "MQTT__CONFIGURATION_URL": PAGE,
            "MQTT__HOLD_SECONDS": "1",
            "MQTT__EXPIRE_AFTER_SECONDS": "600",
        }
        return lookdown(own | settings, calibrations=self.calibrations)

    def until_found(self, server) -> dict:
        """Sends a frame and waits until its counts are shown. Returns the report."""
        report = json.loads(server.post(DETECT, OFFICE))
        self.assertGreater(len(report["persons"]), 3)
        left = report["zones"][0]["persons"]
        counts = {PERSONS: str(len(report["persons"])), LEFT: str(left)}
        self.home.until(counts | {OCCUPANCY: "on", LEFT_OCCUPANCY: "on" if left else "off"})
        return report

    def test_entities_appear_change_and_go_away(self):
        with self.lookdown() as server:
            server.post("/detect?profile=fast", OFFICE)
            server.post(f"{DETECT}&camera=web-page&store=false", OFFICE)
            self.until_found(server)
            entities = self.home.entities()
            self.assertEqual(set(entities), ENTITIES)
            # The example is for the camera "lobby" with the zone "entrance".
            shown = set(re.findall(r"entity: (\S+)", CARD.read_text(encoding="utf-8")))
            shown = {name.replace("lobby", "office").replace("entrance", "left") for name in shown}
            self.assertEqual(shown - {entity["entity"] for entity in entities.values()}, set())
            print("\n" + json.dumps(entities, indent=1))
            version = server.get("/openapi.json")
            for entity in entities.values():
                self.assertEqual(entity["device"], "office")
                self.assertEqual((entity["calibration"], entity["profile"]), ("office", "fast"))
                self.assertEqual(entity["sw_version"], json.loads(version)["info"]["version"])
                self.assertEqual(entity["configuration_url"], PAGE)
            server.post(NO_PERSONS, OFFICE)
            self.home.until({PERSONS: "0", OCCUPANCY: "off", LEFT: "0", LEFT_OCCUPANCY: "off"})
            # A zone that is removed.
            office_calibration(self.calibrations, zones=[])
            wait_until(lambda: "zones" not in json.loads(server.post(DETECT, OFFICE)), "the zone is gone")
            wait_until(lambda: set(self.home.entities()) == {PERSONS, OCCUPANCY}, "the entities of the zone are gone")
            # A camera that is removed.
            self.assertEqual(server.delete("/results/office"), 204)
            wait_until(lambda: self.home.entities() == {}, "the entities of the camera are gone")
            self.assertFalse([topic for topic in self.broker.retained() if "office" in topic])

    def test_entities_of_a_silent_camera_become_unavailable(self):
        with self.lookdown(MQTT__EXPIRE_AFTER_SECONDS=str(EXPIRE_SECONDS)) as server:
            self.until_found(server)
            self.home.until(dict.fromkeys(ENTITIES, "unavailable"), STALE_SECONDS)
            self.until_found(server)

    def test_entities_survive_restarts_of_each_program(self):
        with self.lookdown() as server:
            self.until_found(server)
            counts = {name: entity["state"] for name, entity in self.home.entities().items()}
            self.home.stop()
            self.home.start()
            self.home.until(counts)
            self.broker.stop(signal.SIGKILL)
            self.home.until(dict.fromkeys(ENTITIES, "unavailable"))
            self.broker.start()
            # The broker has kept nothing: the server publishes all again. Home Assistant shows the states of before
            # as soon as it is connected itself.
            online = "the server is connected"
            wait_until(lambda: self.broker.retained().get("lookdown/status") == "online", online, START_SECONDS)
            self.home.until(counts, START_SECONDS)
            os.kill(server.pid, signal.SIGKILL)
            self.home.until(dict.fromkeys(ENTITIES, "unavailable"))
        with self.lookdown(MQTT__EXPIRE_AFTER_SECONDS=str(EXPIRE_SECONDS)) as server:
            # Nothing is shown of the time before, and a camera without frames is withdrawn.
            wait_until(lambda: self.broker.retained().get("lookdown/status") == "online", "the server is connected")
            self.assertEqual(self.home.state(PERSONS), "unavailable")
            wait_until(lambda: self.home.entities() == {}, "the camera is withdrawn", STALE_SECONDS)
            self.until_found(server)


class RunEntities(unittest.TestCase):
    """Entities of the cameras of `lookdown run`."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.broker = self.enterContext(broker(self.folder))
        home = self.folder / "home"
        home.mkdir()
        recipe = re.search(r"```yaml\n(automation:\n[^`]*persistent_notification[^`]*)```", RECIPES.read_text("utf-8"))
        automation = recipe[1].replace("hall", "gate")
        (home / "automations.yaml").write_text(automation, encoding="utf-8")
        self.home = self.enterContext(home_assistant(home, self.broker))

    def start(self, camera: int):
        """Runs Lookdown with a camera."""
        settings = {
            "STATE__PATH": self.folder / "state",
            "COUNTS__PATH": self.folder / "counts.sqlite",
            "MQTT__URL": self.broker.url,
            "MQTT__IMAGE_EVERY_SECONDS": "1",
            "RESULTS__IMAGES": "gate",
        }
        source = f"http://127.0.0.1:{camera}/stream"
        command = ["run", source, "--name", "gate", "--calibration", "office", "--profile", "fast"]
        return lookdown(settings, command=command)

    def test_a_camera_has_an_image_a_switch_and_events(self):
        # Half a minute without persons, and half a minute with some.
        with http_camera([empty_frame()] * 30 + [OFFICE] * 30, 1.0) as camera:
            with self.start(camera):
                self.home.until({"lookdown_gate_detection": "on"}, START_SECONDS)
                wait_until(lambda: self.home.shown()["images"].get("lookdown_gate_image", 0) > 1000, "an image", 60)
                event = wait_until(
                    lambda: self.home.entities().get("lookdown_gate_count_event", {}).get("event"), "", 120
                )
                self.assertEqual(event, "occupancy.reached")
                wait_until(lambda: self.home.shown()["images"].get("lookdown_gate_count_event_image"), "its image")
                wait_until(lambda: self.home.shown()["notifications"], "the notification of the recipe")
                self.home.press("switch.gate_detection", "turn_off")
                self.home.until({"lookdown_gate_detection": "off"})
            self.home.until({"lookdown_gate_detection": "unavailable"})
            # It stays off after a restart, and the page shows it.
            with self.start(camera) as server:
                self.home.until({"lookdown_gate_detection": "off"})
                (shown,) = wait_until(lambda: json.loads(server.get("/cameras")), "the camera is listed")
                self.assertEqual((shown["name"], shown["paused"]), ("gate", True))
                self.assertEqual(json.loads(server.get("/results")), [])
                self.home.press("switch.gate_detection", "turn_on")
                self.home.until({"lookdown_gate_detection": "on"})
                wait_until(lambda: json.loads(server.get("/results")), "the camera is read again", 60)


class Views(unittest.TestCase):
    """Straight live views, in both ways of docs/home-automation.md."""

    def test_a_view_is_a_camera_over_mqtt_and_mjpeg(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        of = self.enterContext(broker(folder))
        settings = {
            "STATE__PATH": folder / "state",
            "MQTT__URL": of.url,
            "MQTT__IMAGE_EVERY_SECONDS": "1",
            "RESULTS__IMAGES": "office",
        }
        calibrations = office_calibration(folder / "calibrations")
        server = self.enterContext(lookdown(settings, calibrations=calibrations))
        put(server, "/cameras/office/views/door", {"width": 320, "height": 240})
        (folder / "home").mkdir()
        url = f"http://{server.address}/cameras/office/views/door.mjpg"
        mjpeg = {"mjpeg_url": url, "still_image_url": None, "authentication": "basic", "verify_ssl": True}
        mjpeg |= {"username": None, "password": ""}
        (folder / "home" / "mjpeg.json").write_text(json.dumps(mjpeg), encoding="utf-8")
        home = self.enterContext(home_assistant(folder / "home", of))
        server.post(DETECT, OFFICE)

        def sizes() -> dict[str, int]:
            images = home.shown()["images"]
            return {name: images.get(name, 0) for name in (VIEW, "mjpeg")}

        wait_until(lambda: server.post(DETECT, OFFICE) and min(sizes().values()) > 1000, "both cameras have images", 60)
        print("\n", sizes(), home.entities()[VIEW])
        self.assertEqual(home.entities()[VIEW]["entity"], "camera.office_view_door")
        self.assertEqual(server.delete("/cameras/office/views/door"), 204)
        wait_until(lambda: VIEW not in home.entities(), "the entity of the view is gone")
        self.assertFalse([topic for topic in of.retained() if "view" in topic])


class CountEntities(CountedCamera):
    """Entities of `lookdown count`."""

    PREFIX = "lookdown_office_count"

    def setUp(self):
        super().setUp()
        self.home = self.enterContext(home_assistant(self.folder / "home", self.broker))

    def counts(self) -> dict[str, str]:
        """The states of its entities."""
        states = {name: entity["state"] for name, entity in self.home.entities().items()}
        return {name: state for name, state in states.items() if name.startswith(self.PREFIX)}

    def test_counts_appear_and_survive_a_kill(self):
        with self.counting() as count:
            wait_until(lambda: count.get("/counts") is not None, "lookdown count answers")
            self.send_frames()
            tracks = wait_until(lambda: (count.get("/counts/office/tracks") or {}).get("tracks"), "there are tracks")
            crossings = {f"{self.PREFIX}_line_middle_{direction}": "0" for direction in ("east", "west")}
            self.home.until(crossings | {f"{self.PREFIX}_tracked": str(len(tracks))}, 60)
            entities = self.home.entities()
            print("\n" + json.dumps({name: entities[name] for name in self.counts()}, indent=1))
            for line in crossings:
                self.assertEqual(entities[line]["state_class"], "total_increasing")
            self.assertEqual({entities[name]["device"] for name in self.counts()}, {"office"})
            entries = int(entities[f"{self.PREFIX}_entries_left"]["state"])
            self.assertGreater(entries, 0)
            count.stop(signal.SIGKILL)
        wait_until(lambda: set(self.counts().values()) == {"unavailable"}, "all entities are unavailable", 60)
        with self.counting():
            self.send_frames()
            self.home.until(crossings)
            self.assertGreaterEqual(int(self.home.state(f"{self.PREFIX}_entries_left")), entries)


if __name__ == "__main__":
    unittest.main()
