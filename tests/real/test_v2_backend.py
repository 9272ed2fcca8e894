"""Inference on another server of the Open Inference Protocol: MLServer."""

import contextlib
import json
import tempfile
import unittest
from collections.abc import Iterator
from pathlib import Path

from harness.places import ROOT, model
from harness.processes import Server, free_ports, running
from remote_inference import FAST, FRAME, MODEL, answer, asking, assert_survives_a_restart, when_ready_is
from support.lookdown import lookdown

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
        assert_survives_a_restart(self, mlserver, {})

    def test_a_server_that_starts_first_waits_for_mlserver(self) -> None:
        (port,) = free_ports(1)
        with lookdown(asking(f"http://127.0.0.1:{port}", "people"), probe="/livez") as server:
            status, _, problem = answer(server, FAST, FRAME)
            self.assertEqual((status, problem["type"]), (503, "/problems/warming-up"))
            with mlserver(port):
                when_ready_is(server, 200)
                self.assertEqual(answer(server, FAST, FRAME)[0], 200)


if __name__ == "__main__":
    unittest.main()
