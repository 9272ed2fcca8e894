"""Inference on another server of the Open Inference Protocol: MLServer."""

import contextlib
import json
import signal
import tempfile
import time
import unittest
from collections.abc import Iterator
from pathlib import Path

from harness.places import ROOT, SAMPLES, model
from harness.processes import Server, free_ports, running
from remote_inference import BALANCED, FAST, FRAME, MODEL, answer, asking, assert_same, when_ready_is
from support.lookdown import lookdown

from metrics import metric

HERE = Path(__file__).resolve().parent
MLSERVER = ROOT / ".setup" / "real" / "v2_backend" / "bin" / "mlserver"
SIDE = 416


@contextlib.contextmanager
def mlserver(port: int) -> Iterator[Server]:
    """MLServer with the default model under the name `people`."""
    grpc, metrics = free_ports(2)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ports = {"http_port": port, "grpc_port": grpc, "metrics_port": metrics}
        settings = {"host": "127.0.0.1", "parallel_workers": 0, "debug": False, **ports}
        (folder / "settings.json").write_text(json.dumps(settings), encoding="utf-8")
        described = {
            "name": "people",
            "implementation": "model.Network",
            "inputs": [{"name": "images", "datatype": "FP32", "shape": [-1, 3, SIDE, SIDE]}],
            "outputs": [
                {"name": "boxes", "datatype": "FP32", "shape": [-1, -1, 4]},
                {"name": "scores", "datatype": "FP32", "shape": [-1, -1]},
            ],
        }
        (folder / "model-settings.json").write_text(json.dumps(described), encoding="utf-8")
        environment = {"MODEL": str(model(MODEL)), "PYTHONPATH": str(HERE / "v2_backend")}
        command = [str(MLSERVER), "start", str(folder)]
        with running("v2_backend", command, port, "/v2/models/people/ready", environment, folder) as server:
            yield server


class RemoteInference(unittest.TestCase):
    """Detections do not depend on the location of the network, and outages are reported and recovered from."""

    def test_mlserver_gives_the_same_detections_and_may_restart(self) -> None:
        with lookdown({"MODEL__PATH": str(model(MODEL).parent)}) as here:
            local = {path: json.loads(here.post(path, FRAME)) for path in (FAST, BALANCED)}
        (port,) = free_ports(1)
        with contextlib.ExitStack() as stack:
            first = contextlib.ExitStack()
            stack.enter_context(first)
            remote = first.enter_context(mlserver(port))
            server = stack.enter_context(lookdown(asking(f"http://127.0.0.1:{port}", "people")))
            for path, wanted in local.items():
                assert_same(self, json.loads(server.post(path, FRAME)), wanted)
            self.assertGreater(metric(server, 'remote_requests_total{result="answered"}'), 0)
            self.assertEqual(metric(server, "remote_up"), 1)

            remote.process.send_signal(signal.SIGKILL)
            remote.process.wait()
            status, headers, problem = answer(server, FAST, FRAME)
            self.assertEqual((status, problem["type"]), (503, "/problems/inference-unavailable"))
            self.assertGreaterEqual(int(headers["Retry-After"]), 1)
            self.assertNotIn(str(port), problem["error"])
            self.assertEqual(when_ready_is(server, 503)["type"], "/problems/inference-unavailable")
            began = time.monotonic()
            self.assertEqual(answer(server, FAST, FRAME)[0], 503)
            self.assertLess(time.monotonic() - began, 1.0, "an open breaker answers at once")
            self.assertEqual(metric(server, "remote_up"), 0)
            self.assertEqual(answer(server, "/livez")[0], 200)
            first.close()

            stack.enter_context(mlserver(port))
            when_ready_is(server, 200)
            assert_same(self, json.loads(server.post(FAST, FRAME)), local[FAST])

    def test_a_server_that_starts_first_waits_for_mlserver(self) -> None:
        (port, own) = free_ports(2)
        variables = asking(f"http://127.0.0.1:{port}", "people") | {"SERVER__LISTEN": f"127.0.0.1:{own}"}
        variables |= {"CALIBRATIONS__PATH": str(SAMPLES / "calibrations"), "SHUTDOWN__GRACE_MILLIS": "0"}
        command = [str(ROOT / "target" / "release" / "lookdown"), "serve"]
        environment = {f"LOOKDOWN__{name}": value for name, value in variables.items()}
        with running("lookdown", command, own, "/livez", environment) as server:
            status, _, problem = answer(server, FAST, FRAME)
            self.assertEqual((status, problem["type"]), (503, "/problems/warming-up"))
            with mlserver(port):
                when_ready_is(server, 200)
                self.assertEqual(answer(server, FAST, FRAME)[0], 200)


if __name__ == "__main__":
    unittest.main()
