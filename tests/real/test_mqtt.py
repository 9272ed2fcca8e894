"""Lookdown with a real MQTT broker, mosquitto, as Home Assistant uses it."""

import contextlib
import json
import os
import signal
import tempfile
import unittest
from pathlib import Path

from cameras import office_calibration
from commands import run
from harness.places import SAMPLES
from mosquitto import PASSWORD, PASSWORD_IN_URL, broker
from state import metric, wait_until
from support.lookdown import TINY, lookdown

OFFICE = (SAMPLES / "office.jpg").read_bytes()
DETECT = "/detect?calibration=office&profile=fast"
STATUS = "lookdown/status"
PERSONS = "lookdown/cameras/office/persons"
OCCUPANCY = "lookdown/cameras/office/occupancy"
AVAILABILITY = "lookdown/cameras/office/availability"
ZONES = "lookdown/cameras/office/zones"
REPORT = "lookdown/cameras/office/report"
CONFIGS = {
    "homeassistant/binary_sensor/lookdown_office_occupancy/config",
    "homeassistant/sensor/lookdown_office_persons/config",
    "homeassistant/sensor/lookdown_office_frame_persons/config",
    "homeassistant/binary_sensor/lookdown_office_zone_left_occupancy/config",
    "homeassistant/sensor/lookdown_office_zone_left/config",
    "homeassistant/binary_sensor/lookdown_office_zone_empty_occupancy/config",
    "homeassistant/sensor/lookdown_office_zone_empty/config",
}
AREAS = [
    {"name": "left", "frame_px": [[0, 0], [480, 0], [480, 960], [0, 960]]},
    {"name": "empty", "frame_px": [[0, 0], [4, 0], [4, 4], [0, 4]]},
]


class Mqtt(unittest.TestCase):
    """Messages at the broker."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.calibrations = office_calibration(self.folder / "calibrations", zones=AREAS)
        self.broker = self.enterContext(broker(self.folder))

    def lookdown(self, **settings: str):
        """A server that publishes."""
        wanted = {"MQTT__URL": self.broker.url} | TINY | settings
        return lookdown(wanted, calibrations=self.calibrations)

    def until_status(self, wanted: str) -> None:
        """Waits until the retained status is `wanted`."""
        wait_until(lambda: self.broker.retained().get(STATUS) == wanted, f"the status is {wanted}")

    def test_counts_reports_and_discovery(self):
        models = {"MODEL__PATH": ""}
        with self.lookdown(**models) as server, self.broker.listening("lookdown/#") as heard:
            self.until_status("online")
            answer = server.post(DETECT, OFFICE)
            wait_until(lambda: heard.of(REPORT) == [answer.decode()], "the report is received")
            report = json.loads(answer)
            self.assertGreater(len(report["persons"]), 3)
            kept = self.broker.retained()
            self.assertEqual(kept[PERSONS], str(len(report["persons"])))
            self.assertNotIn(REPORT, kept)
            for zone in report["zones"]:
                self.assertEqual(kept[f"{ZONES}/{zone['name']}"], str(zone["persons"]))
            self.assertEqual(kept[f"{ZONES}/empty"], "0")
            self.assertEqual(kept[f"{ZONES}/empty/occupancy"], "OFF")
            self.assertEqual((kept[OCCUPANCY], kept[AVAILABILITY]), ("ON", "online"))
            configs = {topic: json.loads(kept[topic]) for topic in kept if topic.startswith("homeassistant/")}
            self.assertEqual(set(configs), CONFIGS)
            ids = {topic.split("/")[1] + config["unique_id"] for topic, config in configs.items()}
            self.assertEqual(len(ids), len(CONFIGS))
            for config in configs.values():
                self.assertIn(config["state_topic"], kept)
                self.assertEqual([it["topic"] for it in config["availability"]], [STATUS, AVAILABILITY])
                self.assertEqual(config["availability_mode"], "all")
                self.assertEqual(config["device"]["identifiers"], ["lookdown_office"])
            self.assertEqual(metric(server, "mqtt_connected"), 1)
            self.assertEqual(metric(server, "mqtt_reports_sent_total"), 1)

    def test_a_starting_home_assistant_gets_all_messages_again(self):
        with self.lookdown() as server:
            server.post(DETECT, OFFICE)
            wait_until(lambda: set(self.broker.retained()) > CONFIGS, "discovery is published")
            for topic in (*CONFIGS, PERSONS):
                self.broker.client("pub", "-r", "-n", "-t", topic)
            self.assertFalse(CONFIGS & set(self.broker.retained()))
            self.broker.client("pub", "-t", "homeassistant/status", "-m", "offline")
            self.broker.client("pub", "-t", "homeassistant/status", "-m", "online")
            wait_until(lambda: {*CONFIGS, PERSONS} < set(self.broker.retained()), "discovery is published")

    def test_the_will_of_a_killed_server_is_offline(self):
        with self.lookdown() as server:
            self.until_status("online")
            os.kill(server.pid, signal.SIGKILL)
            self.until_status("offline")

    def test_a_stopped_server_publishes_offline(self):
        with self.lookdown() as server:
            self.until_status("online")
            with self.broker.listening(STATUS) as heard:
                os.kill(server.pid, signal.SIGTERM)
                self.assertEqual(server.process.wait(timeout=20), 0)
                wait_until(lambda: heard.of(STATUS)[-1:] == ["offline"], "the last message is received")
        self.assertEqual(self.broker.retained()[STATUS], "offline")

    def test_a_restarted_broker_gets_the_current_state(self):
        with self.lookdown() as server:
            server.post(DETECT, OFFICE)
            wait_until(lambda: PERSONS in self.broker.retained(), "the count is right")
            self.broker.stop(signal.SIGKILL)
            wait_until(lambda: metric(server, "mqtt_connected") == 0, "the outage is detected")
            server.post(f"{DETECT}&camera=gate", OFFICE)
            last = json.loads(server.post(f"{DETECT}&score_threshold=1", OFFICE))
            self.broker.start()
            wait_until(lambda: {STATUS, *CONFIGS, PERSONS} < set(self.broker.retained()), "all messages are back")
            kept = self.broker.retained()
            self.assertEqual(kept[STATUS], "online")
            self.assertEqual(kept[PERSONS], str(len(last["persons"])))
            self.assertIn("lookdown/cameras/gate/persons", kept)
            self.assertEqual(metric(server, "mqtt_connected"), 1)
            self.assertEqual(metric(server, "mqtt_reports_dropped_total"), 2)

    def test_a_server_without_its_broker_still_serves(self):
        self.broker.stop()
        with self.lookdown() as server:
            for _ in range(100):
                server.post(DETECT, OFFICE)
            wait_until(lambda: metric(server, "mqtt_reports_dropped_total") == 100, "the count is right")
            os.kill(server.pid, signal.SIGTERM)
            self.assertEqual(server.process.wait(timeout=20), 0)
        self.broker.start()

    def test_the_end_of_one_server_leaves_the_other_online(self):
        with self.lookdown(), contextlib.ExitStack() as other:
            server = other.enter_context(self.lookdown())
            self.until_status("online")
            with self.broker.listening(STATUS) as heard:
                os.kill(server.pid, signal.SIGKILL)
                wait_until(lambda: heard.of(STATUS)[-2:] == ["offline", "online"], "the status is corrected")
            self.assertEqual(self.broker.retained()[STATUS], "online")

    def test_topics_of_removed_cameras_are_withdrawn(self):
        old = "lookdown/cameras/old"
        kept = [f"{old}/persons", f"{old}/zones/till", "homeassistant/sensor/lookdown_old_zone_till/config"]
        for topic in kept:
            self.broker.client("pub", "-r", "-m", "3", "-t", topic)
        with self.lookdown(MQTT__EXPIRE_AFTER_SECONDS="5") as server:
            wait_until(lambda: self.broker.retained().get(f"{old}/availability") == "offline", "it is unavailable")
            server.post(DETECT, OFFICE)
            wait_until(lambda: not [it for it in self.broker.retained() if "old" in it], "the topics are withdrawn")
            self.assertIn(PERSONS, self.broker.retained())
            wait_until(lambda: self.broker.retained()[AVAILABILITY] == "offline", "the silent camera is unavailable")

    def test_deleted_results_are_withdrawn(self):
        with self.lookdown() as server:
            server.post(DETECT, OFFICE)
            wait_until(lambda: set(self.broker.retained()) > CONFIGS, "discovery is published")
            self.assertEqual(server.delete("/results/office"), 204)
            wait_until(lambda: not [it for it in self.broker.retained() if "office" in it], "the topics are withdrawn")

    def test_names_are_encoded_and_limited_in_number(self):
        with self.lookdown(MQTT__MAX_CAMERAS="3") as server:
            for camera in ("a%2Fb", "%23", "n%C3%B6rd+lich", "fourth", "fifth"):
                server.post(f"{DETECT}&camera={camera}", OFFICE)
            wait_until(lambda: metric(server, "mqtt_reports_dropped_total") == 2, "the reports are dropped")
            self.assertEqual(metric(server, "mqtt_reports_sent_total"), 3)
            topics = [topic for topic in self.broker.retained() if topic.endswith("/persons")]
            self.assertEqual(len(topics), 3)
            self.assertTrue(all(topic.count("/") == 3 for topic in topics), topics)

    def test_a_wrong_password_is_logged_once_and_never_shown(self):
        wrong = self.broker.url.replace(PASSWORD_IN_URL, "wr0ng")
        with self.lookdown(MQTT__URL=wrong, LOG__FILTER="trace") as server:
            server.post(DETECT, OFFICE)
            wait_until(lambda: "mqtt.url" in server.log.read_text(errors="replace"), "the warning is logged")
            text = server.log.read_text(errors="replace")
        self.assertEqual(text.count("not publishing"), 1)
        for secret in ("wr0ng", PASSWORD, PASSWORD_IN_URL):
            self.assertNotIn(secret, text)


class MqttOverTls(unittest.TestCase):
    """MQTT over TLS."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        authority, authority_key = self.folder / "authority.pem", self.folder / "authority.key"
        request, names = self.folder / "broker.csr", self.folder / "names"
        certificate, key = self.folder / "broker.pem", self.folder / "broker.key"
        names.write_text("subjectAltName=DNS:localhost\n", encoding="utf-8")
        new_key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
        for command in (
            ["req", "-x509", *new_key, "-days", "2", "-subj", "/CN=home", "-keyout", authority_key, "-out", authority],
            ["req", *new_key, "-subj", "/CN=localhost", "-keyout", key, "-out", request],
            [
                *("x509", "-req", "-in", request, "-CA", authority, "-CAkey", authority_key, "-CAcreateserial"),
                *("-days", "2", "-extfile", names, "-out", certificate),
            ],
        ):
            run("openssl", *command)
        tls = {"certfile": certificate, "keyfile": key, "cafile": authority}
        self.broker = self.enterContext(broker(self.folder, tls))

    def test_a_broker_with_a_trusted_certificate_is_used(self):
        settings = {"MQTT__URL": self.broker.url, "MQTT__AUTHORITIES": str(self.broker.tls["cafile"])}
        with lookdown(TINY | settings):
            wait_until(lambda: self.broker.retained().get(STATUS) == "online", "the status is online")

    def test_a_broker_with_an_untrusted_certificate_is_refused(self):
        with lookdown(TINY | {"MQTT__URL": self.broker.url}) as server:
            server.post(DETECT, OFFICE)
            wait_until(lambda: "not publishing" in server.log.read_text(errors="replace"), "the warning is logged")
            self.assertEqual(self.broker.retained(), {})
