"""Inference on Triton Inference Server."""

import contextlib
import json
import signal
import unittest
import urllib.request

from harness.places import model
from harness.processes import Server, free_ports
from remote_inference import BALANCED, FAST, FRAME, MODEL, answer, asking, assert_same, when_ready_is
from support.lookdown import lookdown
from triton_server import STUB, VERSION, triton

from metrics import metric

PATIENT = {"SERVER__REQUEST_TIMEOUT_MILLIS": "120000"}
"""Lets a busy machine finish a frame."""


@unittest.skipUnless(STUB.exists(), f"the wheel has no Python backend for Python {VERSION}")
class Triton(unittest.TestCase):
    """Triton collects views into batches, gets and returns tensors as bytes, and unloads models while it serves."""

    def test_triton_gives_the_same_detections_and_may_restart(self) -> None:
        with lookdown(PATIENT | {"MODEL__PATH": str(model(MODEL).parent)}) as here:
            local = {path: json.loads(here.post(path, FRAME)) for path in (FAST, BALANCED)}
        (port,) = free_ports(1)
        with contextlib.ExitStack() as stack:
            first = contextlib.ExitStack()
            stack.enter_context(first)
            remote = first.enter_context(triton(port, MODEL))
            server = stack.enter_context(lookdown(PATIENT | asking(f"http://{remote.address}", "people")))
            before = self._inferred(remote)
            for path, wanted in local.items():
                assert_same(self, json.loads(server.post(path, FRAME)), wanted)
            inferred = sum(report["views"]["inferred"] for report in local.values())
            self.assertEqual(self._inferred(remote) - before, inferred)
            self.assertEqual(metric(server, "remote_up"), 1)

            remote.process.send_signal(signal.SIGKILL)
            remote.process.wait()
            status, _, problem = answer(server, FAST, FRAME)
            self.assertEqual((status, problem["type"]), (503, "/problems/inference-unavailable"))
            when_ready_is(server, 503)
            first.close()

            stack.enter_context(triton(port, MODEL))
            when_ready_is(server, 200)
            assert_same(self, json.loads(server.post(FAST, FRAME)), local[FAST])

    def test_a_model_that_triton_unloads_may_come_back(self) -> None:
        (port,) = free_ports(1)
        with triton(port, MODEL) as remote, lookdown(PATIENT | asking(f"http://{remote.address}", "people")) as server:
            self._post(remote, "/v2/repository/models/people/unload")
            status, _, problem = answer(server, FAST, FRAME)
            self.assertEqual((status, problem["type"]), (503, "/problems/inference-unavailable"))
            self.assertEqual(when_ready_is(server, 503)["type"], "/problems/inference-unavailable")
            self._post(remote, "/v2/repository/models/people/load")
            when_ready_is(server, 200)
            self.assertEqual(answer(server, FAST, FRAME)[0], 200)

    def _inferred(self, remote: Server) -> int:
        """The number of views that Triton has inferred."""
        (stats,) = json.loads(remote.get("/v2/models/people/stats"))["model_stats"]
        return stats["inference_count"]

    def _post(self, remote: Server, path: str) -> None:
        urllib.request.urlopen(f"http://{remote.address}{path}", b"{}", timeout=60).close()


if __name__ == "__main__":
    unittest.main()
