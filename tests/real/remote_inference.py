"""Helpers of the tests of inference on another server."""

import json
import unittest
import urllib.error
import urllib.request
from email.message import Message

from harness.places import SAMPLES, model
from harness.processes import Server
from waiting import wait_until

MODEL = "nanodet_g_views_416_fp16"
"""Every library computes it in FP32, and INT8 in its own way."""
FRAME = (SAMPLES / "office.jpg").read_bytes()
FAST = "/detect?calibration=office&profile=fast"
BALANCED = "/detect?calibration=office"
NOTICED_SECONDS = 20.0
"""Time within which a server must detect that the other has gone or returned."""


def asking(url: str, name: str = "") -> dict[str, str]:
    """Settings of a server that uses another one for inference."""
    there = {"INFERENCE__BACKEND": "v2", "INFERENCE__URL": url, "INFERENCE__TIMEOUT_MILLIS": "60000"}
    return there | {"INFERENCE__MODEL": name or MODEL, "MODEL__PATH": str(model(MODEL).parent)}


def answer(server: Server, path: str, body: bytes | None = None) -> tuple[int, Message, dict]:
    """Status, headers and JSON of an answer."""
    request = urllib.request.Request(f"http://{server.address}{path}", body, {"Content-Type": "image/jpeg"})
    try:
        with urllib.request.urlopen(request, timeout=120) as told:
            return told.status, told.headers, json.loads(told.read())
    except urllib.error.HTTPError as error:
        return error.code, error.headers, json.loads(error.read())


def when_ready_is(server: Server, status: int) -> dict:
    """The answer of `/readyz` once it has that status."""

    def said() -> dict | None:
        found, _, told = answer(server, "/readyz")
        return told if found == status else None

    return wait_until(said, f"/readyz answers {status}", NOTICED_SECONDS)


def assert_same(test: unittest.TestCase, report: dict, wanted: dict) -> None:
    """Asserts that boxes agree to a hundredth of a pixel, and scores to a thousandth."""
    test.assertGreater(len(wanted["persons"]), 0)
    test.assertEqual(len(report["persons"]), len(wanted["persons"]))
    for person, other in zip(report["persons"], wanted["persons"]):
        test.assertAlmostEqual(person["score"], other["score"], delta=1e-3)
        test.assertEqual(person["views"], other["views"])
        for side, place in other["box"].items():
            test.assertAlmostEqual(person["box"][side], place, delta=0.02, msg=side)
