"""Inference on another server of the Open Inference Protocol: MLServer, and Lookdown itself."""

import contextlib
import hashlib
import json
import os
import signal
import subprocess
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

    def test_lookdown_can_be_the_inference_server_with_bytes(self) -> None:
        with lookdown({"MODEL__PATH": str(model(MODEL).parent), "LIMITS__MAX_FRAMES_IN_FLIGHT": "64"}) as here:
            with lookdown(asking(f"http://{here.address}")) as front:
                for path in (FAST, BALANCED):
                    assert_same(self, json.loads(front.post(path, FRAME)), json.loads(here.post(path, FRAME)))

    def test_the_bearer_token_is_sent(self) -> None:
        keys = f"front:detect:{hashlib.sha256(b's3cret').hexdigest()}"
        with lookdown({"MODEL__PATH": str(model(MODEL).parent), "ACCESS__KEYS": keys}) as here:
            there = asking(f"http://{here.address}")
            with lookdown(there | {"INFERENCE__BEARER_TOKEN": "s3cret"}) as front:
                self.assertGreater(len(json.loads(front.post(FAST, FRAME))["persons"]), 0)
            (own,) = free_ports(1)
            variables = there | {"SERVER__LISTEN": f"127.0.0.1:{own}", "INFERENCE__BEARER_TOKEN": "mist4ken"}
            environment = {f"LOOKDOWN__{name}": value for name, value in variables.items()}
            command = [str(ROOT / "target" / "release" / "lookdown"), "serve"]
            refused = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, timeout=60)
            self.assertNotEqual(refused.returncode, 0)
            self.assertIn("401", refused.stderr)
            self.assertNotIn("mist4ken", refused.stderr)


if __name__ == "__main__":
    unittest.main()
