"""Lookdown as the server of clients from PyPI: deepstack-python, deepstack-sdk and codeproject-ai-api."""

import hashlib
import json
import tempfile
import unittest
from pathlib import Path

from commands import run
from harness.places import ROOT, SAMPLES
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent
PYTHON = ROOT / ".setup" / "real" / "deepstack" / "bin" / "python"
CLIENTS = ("python", "sdk")
EVERY_CLIENT = (*CLIENTS, "codeproject")
"""Also the one that sends no key."""
OFFICE = SAMPLES / "office.jpg"
KEY = "lookdown_of_home_assistant"


def ask(client: str, server, image: Path = OFFICE, model: str = "", key: str = "", confidence: float = 0.4) -> dict:
    """The result of a client."""
    port = server.address.rpartition(":")[2]
    return json.loads(run(PYTHON, HERE / "deepstack_client.py", client, port, image, model, key, confidence))


class DeepStackClients(unittest.TestCase):
    """Detections and errors as the clients return them."""

    @classmethod
    def setUpClass(cls):
        cls.server = cls.enterClassContext(lookdown({}))
        report = json.loads(cls.server.post("/detect?calibration=office&score_threshold=0.4", OFFICE.read_bytes()))
        cls.persons = len(report["persons"])

    def test_all_detect_persons_with_and_without_a_calibration(self):
        self.assertGreater(self.persons, 3)
        for client in EVERY_CLIENT:
            for model in ("", "office"):
                with self.subTest(client=client, model=model):
                    predictions = ask(client, self.server, model=model)["predictions"]
                    self.assertEqual(len(predictions), self.persons)
                    for person in predictions:
                        self.assertEqual(person["label"], "person")
                        self.assertGreaterEqual(person["confidence"], 0.4)
                        edges = [person[edge] for edge in ("x_min", "y_min", "x_max", "y_max")]
                        self.assertTrue(all(isinstance(edge, int) and 0 <= edge <= 960 for edge in edges), edges)
                        self.assertLess(edges[0], edges[2])
                        self.assertLess(edges[1], edges[3])

    def test_confidence_filters_and_may_give_no_persons(self):
        for client in EVERY_CLIENT:
            found = {least: ask(client, self.server, confidence=least)["predictions"] for least in (0.0, 0.6, 1.0)}
            counts = {least: len(predictions) for least, predictions in found.items()}
            self.assertGreaterEqual(counts[0.0], self.persons)
            self.assertTrue(0 < counts[0.6] <= self.persons, counts)
            self.assertEqual(counts[1.0], 0)

    def test_failures_have_the_forms_of_deepstack(self):
        with tempfile.NamedTemporaryFile(suffix=".jpg") as file:
            file.write(b"no image")
            file.flush()
            invalid = Path(file.name)
            self.assertIn("Invalid image", ask("sdk", self.server, invalid)["raised"])
            self.assertIn("status code: 400", ask("python", self.server, invalid)["raised"])
        self.assertIn("Bad url", ask("python", self.server, model="unknown")["raised"])
        self.assertIn("404", ask("sdk", self.server, model="unknown")["raised"])

    def test_their_detections_are_stored_as_results(self):
        ask("python", self.server, model="office")
        report = json.loads(self.server.get("/results/office/latest"))
        self.assertEqual(len(report["persons"]), self.persons)


class Keys(unittest.TestCase):
    """The key that they send in the form."""

    def test_only_a_known_key_is_accepted(self):
        digest = hashlib.sha256(KEY.encode()).hexdigest()
        with lookdown({"ACCESS__KEYS": f"home:detect:{digest}", "LOG__FILTER": "trace"}) as server:
            for client in CLIENTS:
                self.assertGreater(len(ask(client, server, key=KEY)["predictions"]), 3)
                for key in ("", "wrong"):
                    self.assertIn("401", ask(client, server, key=key)["raised"])
            log = server.log.read_text(errors="replace")
        self.assertIn("/v1/vision/detection", log)
        self.assertNotIn(KEY, log)
