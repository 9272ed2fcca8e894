"""The Python wheel in a clean environment: `pip install`, then detection, projection and the command line."""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from urllib.request import Request, urlopen

from commands import run
from harness.places import ROOT, SAMPLES
from rendered_room import plain_disc, rendered_room
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent / "python_package"
CHECKED = ROOT / ".setup" / "real" / "python_package" / "bin" / "python"
OFFICE = SAMPLES / "office.jpg"
CALIBRATION = SAMPLES / "calibrations" / "office.json"


class PythonPackage(unittest.TestCase):
    """The wheel of `make wheel`."""

    @classmethod
    def setUpClass(cls):
        (wheel,) = (ROOT / "target" / "quick" / "wheels").glob("*.whl")
        folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.folder = folder
        started = time.monotonic()
        run(sys.executable, "-m", "venv", folder / "venv", environment=clean())
        cls.bin = folder / "venv" / "bin"
        pip = [cls.bin / "pip", "install", "--quiet", "--disable-pip-version-check"]
        run(*pip, wheel, environment=clean())
        installed = time.monotonic()
        command = [cls.bin / "lookdown", "detect", OFFICE, "--calibration", CALIBRATION]
        report = run(*command, cwd=folder, environment=clean())
        cls.report = json.loads(report)
        print(
            f"\n  wheel {wheel.stat().st_size / 1e6:.1f} MB; pip install {installed - started:.1f} s; "
            f"first persons {time.monotonic() - started:.1f} s"
        )

    def checked(self, program: str, *arguments: str | Path) -> str:
        """Runs a program with the installed wheel and the libraries that it is compared with."""
        (packages,) = self.bin.parent.glob("lib/python*/site-packages")
        environment = clean() | {"PYTHONPATH": str(packages)}
        return run(CHECKED, HERE / program, *arguments, cwd=self.folder, environment=environment)

    def test_the_command_detects_without_a_compiler_or_a_download(self):
        self.assertGreaterEqual(len(self.report["persons"]), 4)

    def test_persons_are_those_of_the_server_to_the_last_digit(self):
        program = (
            "import json, sys, lookdown\n"
            "detections = lookdown.Detector().detect(sys.argv[1], sys.argv[2])\n"
            "print(json.dumps(detections.report))\n"
        )
        command = [self.bin / "python", "-c", program, OFFICE, CALIBRATION]
        report = json.loads(run(*command, cwd=self.folder, environment=clean()))
        with lookdown({}, calibrations=SAMPLES / "calibrations") as server:
            headers = {"Content-Type": "image/jpeg"}
            request = Request(f"http://{server.address}/detect?calibration=office", OFFICE.read_bytes(), headers)
            with urlopen(request, timeout=60) as response:
                served = json.load(response)
        self.assertEqual(report["persons"], served["persons"])
        self.assertEqual(self.report["persons"], served["persons"])

    def test_arrays_give_the_same_persons_as_their_file(self):
        self.assertEqual(self.checked("arrays.py", OFFICE, CALIBRATION).strip(), "equal")

    def test_the_server_starts_from_the_package_and_stops_at_ctrl_c(self):
        environment = {**clean(), "LOOKDOWN__SERVER__LISTEN": "127.0.0.1:0"}
        server = subprocess.Popen(
            [self.bin / "lookdown", "serve"], cwd=self.folder, env=environment, stderr=subprocess.PIPE, text=True
        )
        self.addCleanup(server.kill)
        with server.stderr:
            address = next(address for line in server.stderr if (address := _listening(line)))
            with urlopen(f"http://{address}/livez", timeout=10) as response:
                self.assertEqual(response.status, 200)
            server.send_signal(2)
            server.stderr.read()
        self.assertEqual(server.wait(timeout=30), 0)

    def test_projection_equals_that_of_opencv(self):
        said = json.loads(self.checked("against_opencv.py"))
        print(f"\n  {said}")
        self.assertLess(said["project_pixels"], 1e-6)
        self.assertLess(said["unproject_radians"], 1e-6)

    def test_a_bad_value_is_one_sentence(self):
        program = "import lookdown\nlookdown.Detector(profile='x')"
        done = subprocess.run([self.bin / "python", "-c", program], capture_output=True, text=True, check=False)
        self.assertIn('LookdownError: profile: "x" is not one of paper, fast, balanced, quality, direct', done.stderr)

    def test_the_types_are_complete(self):
        # Only the package itself: mypy would check other packages in its path, too.
        (package,) = self.bin.parent.glob("lib/python*/site-packages/lookdown")
        path = self.folder / "typed"
        path.mkdir()
        (path / "lookdown").symlink_to(package)
        environment = clean() | {"MYPYPATH": str(path)}
        said = run(CHECKED, "-m", "mypy", "--strict", HERE / "example.py", environment=environment)
        self.assertIn("no issues found", said)

    def test_the_example_runs(self):
        self.checked("example.py", SAMPLES)
        for name in ("straightened.png", "persons.png"):
            self.assertGreater((self.folder / name).stat().st_size, 10_000)

    def test_a_calibration_is_found_in_frames_of_a_room(self):
        example, room = ROOT / "docs" / "examples" / "calibrate.py", self.folder / "room.png"
        room.write_bytes(rendered_room())
        said = self.checked(example, room)
        self.assertIn("lens measured", said)
        file = json.loads((self.folder / "camera.json").read_text(encoding="utf-8"))
        self.assertAlmostEqual(file["lens"]["cx"], 279.5, delta=2)
        self.assertEqual(file["mount"]["height_m"], 2.8)
        self.assertTrue((self.folder / "preview.jpg").read_bytes().startswith(b"\xff\xd8"))
        room.write_bytes(plain_disc())
        with self.assertRaisesRegex(AssertionError, "not calibrated: .*give another frame"):
            self.checked(example, room)


def clean() -> dict[str, str]:
    """The environment without what Python or Lookdown would take from it."""
    return {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "LOOKDOWN"))}


def _listening(line: str) -> str | None:
    """Returns the address in the line of the log that names it."""
    found = re.search(r"listening on http://([\d.:]+)", line)
    return found[1] if found else None


if __name__ == "__main__":
    unittest.main()
