"""Annotation files and the examples with the packages of labeling tools: supervision, Label Studio's and CVAT's SDK."""

import contextlib
import json
import math
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path
from urllib.request import Request, urlopen

from cameras import Handler, serving
from commands import run
from harness.places import LOOKDOWN, ROOT, SAMPLES
from harness.processes import free_ports
from state import wait_until
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent
PYTHON = ROOT / ".setup" / "real" / "labelling" / "bin" / "python"
EXAMPLES = ROOT / "docs" / "examples"
FAST = ("--profile", "fast", "--score-threshold", "0.3")
TOKEN = "token-of-the-user"
QUIET = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "MPLBACKEND": "agg"}


class Labelling(unittest.TestCase):
    """Files of `lookdown detect`, and predictions of the examples, read by the tools."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.images = cls.folder / "images"
        cls.images.mkdir()
        for name in ("office.jpg", "canteen.jpg"):
            shutil.copy(SAMPLES / name, cls.images)
        for name in ("yolo", "labelstudio"):
            out = ["--format", name, "--oriented", "--out", str(cls.folder / name)]
            run(LOOKDOWN, "detect", cls.images, *FAST, *out)
        with lookdown({}) as server:
            address = f"http://{server.address}"
            cls.reports = {
                path.name: json.loads(server.post("/detect?profile=fast&score_threshold=0.3", path.read_bytes()))
                for path in cls.images.iterdir()
            }
            office = (cls.images / "office.jpg").read_bytes()
            calibrated = server.post("/detect?calibration=office&profile=fast&score_threshold=0.5", office)
            cls.calibrated = json.loads(calibrated)["persons"]
            cls.predicted = predictions(address, office)
            (cls.folder / "predictions.json").write_text(json.dumps(cls.predicted), encoding="utf-8")
            readers = HERE / "labelling" / "readers.py"
            read = run(PYTHON, readers, cls.folder, cls.images, address, environment=QUIET)
            cls.read = json.loads(read.splitlines()[-1])
            # A line that the first person crosses on its way of 75 pixels.
            line = cls.calibrated[0]["oriented_box"]["cx"] + 35
            cls.crossed, cls.heat_map = crossings(address, cls.folder, line)

    def test_supervision_reads_the_corners_of_yolo_obb(self) -> None:
        self.assertEqual(self.read["obb"]["classes"], ["person"])
        for name, report in self.reports.items():
            found = self.read["obb"]["corners"][name]
            self.assertEqual(len(found), len(report["persons"]), name)
            self.assertGreater(len(found), 0, name)
            for box, person in zip(found, report["persons"]):
                # supervision rounds to whole pixels; corners outside the image are moved into it.
                for corner, expected in zip(box, corners(person["oriented_box"])):
                    for side, position in zip(corner, expected):
                        self.assertAlmostEqual(side, min(max(position, 0), 960), delta=1.01)

    def test_label_studio_accepts_tasks_and_predictions(self) -> None:
        self.assertEqual(self.read["label_studio"], {"tasks": [True, True], "errors": []})
        tasks = json.loads((self.folder / "labelstudio" / "tasks.json").read_text(encoding="utf-8"))
        for task in tasks:
            report = self.reports[task["data"]["image"].removeprefix("/data/local-files/?d=")]
            self.assert_rectangles(task["predictions"][0]["result"], report["persons"])

    def test_the_label_studio_backend_predicts_persons(self) -> None:
        self.assertEqual(self.predicted["model_version"], "lookdown")
        (prediction,) = self.predicted["results"]
        self.assertGreater(len(prediction["result"]), 0)

    def test_cvat_accepts_the_shapes_of_the_function(self) -> None:
        shapes = self.read["cvat"]
        # The image is compressed again, so that scores change a little.
        self.assertAlmostEqual(len(shapes), len(self.calibrated), delta=1)
        self.assertGreater(len(shapes), 0)
        for shape in shapes:
            self.assertEqual((shape["type"], shape["label"], shape["frame"]), ("rectangle", 77, 3))
            self.assertTrue(0 <= shape["rotation"] < 360)
            left, top, right, bottom = shape["points"]
            self.assertTrue(left < right and top < bottom)

    def test_supervision_counts_crossings_and_draws_a_heat_map(self) -> None:
        self.assertEqual(self.crossed["frames"], 4)
        self.assertGreater(self.crossed["in"] + self.crossed["out"], 0)
        self.assertEqual(min(self.crossed["in"], self.crossed["out"]), 0, "all persons move in one direction")
        self.assertEqual(self.heat_map[:4], b"\x89PNG")

    def assert_rectangles(self, regions: list[dict], persons: list[dict]) -> None:
        """Each rectangle has the center of its oriented box when it is rotated about its upper left corner."""
        self.assertEqual(len(regions), len(persons))
        for region, person in zip(regions, persons):
            value, box = region["value"], person["oriented_box"]
            scale = (region["original_width"] / 100, region["original_height"] / 100)
            x, y, width, height = (value[side] * scale[at % 2] for at, side in enumerate(("x", "y", "width", "height")))
            sin, cos = math.sin(math.radians(value["rotation"])), math.cos(math.radians(value["rotation"]))
            center = (x + cos * width / 2 - sin * height / 2, y + sin * width / 2 + cos * height / 2)
            for found, expected in zip((*center, width, height), (box["cx"], box["cy"], box["width"], box["height"])):
                self.assertAlmostEqual(found, expected, delta=0.1)


def corners(box: dict) -> list[tuple[float, float]]:
    """The corners of an oriented box, clockwise from the upper left one."""
    sin, cos = math.sin(math.radians(box["angle_deg"])), math.cos(math.radians(box["angle_deg"]))
    found = []
    for across, along in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
        x, y = across * box["width"], along * box["height"]
        found.append((box["cx"] + cos * x - sin * y, box["cy"] + sin * x + cos * y))
    return found


class Images(Handler):
    """Serves an image to clients with the token, like Label Studio."""

    content = b""

    def do_GET(self) -> None:
        known = self.headers.get("Authorization") == f"Token {TOKEN}"
        self.answer(200 if known else 401, self.content if known else b"")


def predictions(server: str, image: bytes) -> dict:
    """The answer of the backend to Label Studio's request for predictions."""
    Images.content = image
    with serving(Images) as tool:
        return answered(server, f"http://127.0.0.1:{tool}")


def answered(server: str, label_studio: str) -> dict:
    """The answer of the backend while Label Studio serves its image."""
    (port,) = free_ports(1)
    environment = os.environ | {"LABEL_STUDIO_URL": label_studio, "LABEL_STUDIO_TOKEN": TOKEN}
    flags = ["--server", server, "--port", str(port), "--profile", "fast"]
    command = [str(PYTHON), str(EXAMPLES / "label_studio_backend.py"), *flags]
    with subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) as backend:
        try:
            wait_until(lambda: is_up(f"http://127.0.0.1:{port}/health"), "the backend answers")
            tasks = {"tasks": [{"id": 1, "data": {"image": "/data/upload/1/office.jpg"}}]}
            request = Request(f"http://127.0.0.1:{port}/predict", data=json.dumps(tasks).encode())
            with urlopen(request, timeout=60) as answer:
                return json.load(answer)
        finally:
            backend.terminate()


def is_up(address: str) -> bool:
    """Returns true if a server answers."""
    with contextlib.suppress(OSError):
        urlopen(address, timeout=5).close()
        return True
    return False


def crossings(server: str, folder: Path, x: float) -> tuple[dict, bytes]:
    """The counts and the heat map of the example for a frame that moves to the right in four steps."""
    shift = (
        "import cv2, sys, numpy as np; frame = cv2.imread(sys.argv[1]); "
        "[cv2.imwrite(f'{sys.argv[2]}/moved-{step}.png', np.roll(frame, 25 * step, axis=1)) for step in range(4)]"
    )
    run(PYTHON, "-c", shift, SAMPLES / "office.jpg", folder, environment=QUIET)
    frames = [str(folder / f"moved-{step}.png") for step in range(4)]
    heat_map = folder / "heat.png"
    flags = ["--server", server, "--calibration", "office", "--profile", "fast", "--max-step", "40"]
    flags += ["--line", f"{x},0,{x},960", "--heat-map", str(heat_map)]
    printed = run(PYTHON, EXAMPLES / "supervision_lines.py", *frames, *flags, environment=QUIET)
    return json.loads(printed), heat_map.read_bytes()


if __name__ == "__main__":
    unittest.main()
