"""Detection with Triton's own client, `tritonclient[http]`, in a separate environment."""

import json
import os
import unittest
from pathlib import Path

from commands import run
from harness.places import ROOT, SAMPLES
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent
PYTHON = ROOT / ".setup" / "real" / "v2_client" / "bin" / "python"
ASKING = HERE / "v2_client" / "ask.py"


class TritonClient(unittest.TestCase):
    """One server, called by a client of the protocol."""

    @classmethod
    def setUpClass(cls) -> None:
        frame = (SAMPLES / "office.jpg").read_bytes()
        with lookdown({}) as server:
            cls.report = json.loads(server.post("/detect?calibration=office&profile=fast", frame))
            environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
            said = run(PYTHON, ASKING, server.address, SAMPLES / "office.jpg", environment=environment)
        cls.told = json.loads(said)

    def test_it_reports_a_live_and_ready_server(self) -> None:
        self.assertEqual(self.told["health"], [True, True, True, False])
        self.assertEqual(self.told["server"]["name"], "lookdown")
        self.assertIn("binary_tensor_data", self.told["server"]["extensions"])
        self.assertEqual(self.told["model"]["inputs"], [{"name": "image", "datatype": "BYTES", "shape": [-1]}])

    def test_json_and_bytes_give_the_persons_of_the_report(self) -> None:
        persons = self.report["persons"]
        self.assertGreater(len(persons), 0)
        self.assertEqual(len(self.told["found"]), 5)
        for way, found in self.told["found"].items():
            self.assertEqual(len(found["boxes"]), len(persons), way)
            for box, score, person in zip(found["boxes"], found["scores"], persons):
                self.assertAlmostEqual(score, person["score"], places=4)
                for side, name in zip(box, ("x_min", "y_min", "x_max", "y_max")):
                    self.assertAlmostEqual(side, person["box"][name], places=2)
            self.assertEqual([len(row) for row in found["oriented_boxes"]], [5] * len(persons))
            self.assertEqual(found["counts"], [len(persons)])
            self.assertEqual(found["views"], [person["views"] for person in persons])
            self.assertEqual(len(json.loads(found["report"])["persons"]), len(persons))
            self.assertEqual((found["model"], found["id"]), ("lookdown", "17"))

    def test_a_batch_has_the_persons_of_each_frame(self) -> None:
        count = len(self.report["persons"])
        for way, found in self.told["batch"].items():
            self.assertEqual(found["counts"], [count] * 3, way)
            self.assertEqual(len(found["reports"]), 3, way)
            self.assertEqual(found["scores"], found["scores"][:count] * 3, way)

    def test_asynchronous_requests_are_answered(self) -> None:
        self.assertEqual(self.told["asynchronous"], [len(self.report["persons"])] * 3)

    def test_refusals_are_returned_as_one_sentence(self) -> None:
        refused = self.told["refused"]
        for name, (status, part) in {
            "unknown model": ("404", "model: "),
            "no image": ("415", "JPEG"),
            "too many frames": ("422", "[16]"),
            "sequence": ("400", "sequence_id"),
            "shared memory": ("422", "shared memory"),
            "classes": ("422", "classification"),
            "unknown output": ("422", "masks"),
        }.items():
            self.assertEqual(refused[name][0], status, (name, refused[name]))
            self.assertIn(part, refused[name][1], name)
            self.assertNotIn("\n", refused[name][1], name)


if __name__ == "__main__":
    unittest.main()
