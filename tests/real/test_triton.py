"""Inference on Triton Inference Server."""

import json
import unittest
import urllib.request

from harness.processes import Server, free_ports
from remote_inference import FAST, FRAME, MODEL, answer, asking, assert_survives_a_restart, when_ready_is
from support.lookdown import lookdown
from triton_server import STUB, VERSION, triton

PATIENT = {"SERVER__REQUEST_TIMEOUT_MILLIS": "120000"}
"""Lets a busy machine finish a frame."""


@unittest.skipUnless(STUB.exists(), f"the wheel has no Python backend for Python {VERSION}")
class Triton(unittest.TestCase):
    """Triton collects views into batches, gets and returns tensors as bytes, and unloads models while it serves."""

    def test_triton_gives_the_same_detections_and_may_restart(self) -> None:
        assert_survives_a_restart(self, lambda port: triton(port, MODEL), PATIENT, self._inferred)

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
