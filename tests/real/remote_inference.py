"""Helpers of the tests of inference on another server."""

import contextlib
import json
import signal
import time
import unittest
import urllib.error
import urllib.request
from collections.abc import Callable
from email.message import Message

from harness.places import SAMPLES, model
from harness.processes import Server, free_ports
from state import metric, wait_until
from support.lookdown import lookdown

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


def assert_survives_a_restart(
    test: unittest.TestCase,
    start: Callable[[int], contextlib.AbstractContextManager[Server]],
    settings: dict[str, str],
    inferred: Callable[[Server], int] = lambda _: 0,
) -> None:
    """Asserts that the detections are those of a local network, also after the inference server was killed.

    `start` starts it on a port, and `inferred` is the number of its views, where it counts them.
    """
    with lookdown(settings | {"MODEL__PATH": str(model(MODEL).parent)}) as here:
        local = {path: json.loads(here.post(path, FRAME)) for path in (FAST, BALANCED)}
    (port,) = free_ports(1)
    with contextlib.ExitStack() as stack:
        first = stack.enter_context(contextlib.ExitStack())
        remote = first.enter_context(start(port))
        server = stack.enter_context(lookdown(settings | asking(f"http://127.0.0.1:{port}", "people")))
        before = inferred(remote)
        for path, wanted in local.items():
            assert_same(test, json.loads(server.post(path, FRAME)), wanted)
        views = sum(report["views"]["inferred"] for report in local.values())
        if counted := inferred(remote):
            test.assertEqual(counted - before, views)
        test.assertGreater(metric(server, 'remote_requests_total{result="answered"}'), 0)
        test.assertEqual(metric(server, "remote_up"), 1)

        remote.process.send_signal(signal.SIGKILL)
        remote.process.wait()
        status, headers, problem = answer(server, FAST, FRAME)
        test.assertEqual((status, problem["type"]), (503, "/problems/inference-unavailable"))
        test.assertGreaterEqual(int(headers["Retry-After"]), 1)
        test.assertNotIn(str(port), problem["error"])
        test.assertEqual(when_ready_is(server, 503)["type"], "/problems/inference-unavailable")
        began = time.monotonic()
        test.assertEqual(answer(server, FAST, FRAME)[0], 503)
        test.assertLess(time.monotonic() - began, 1.0, "an open breaker answers at once")
        test.assertEqual(metric(server, "remote_up"), 0)
        test.assertEqual(answer(server, "/livez")[0], 200)
        first.close()

        stack.enter_context(start(port))
        when_ready_is(server, 200)
        assert_same(test, json.loads(server.post(FAST, FRAME)), local[FAST])
