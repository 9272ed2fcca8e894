"""The flow of docs/examples/node-red.json in Node-RED: it sends snapshots of a camera and counts the persons."""

import contextlib
import json
import os
import re
import subprocess
import tempfile
import unittest
from collections.abc import Iterator
from pathlib import Path

from cameras import Handler, serving
from commands import run
from harness.places import ROOT, SAMPLES
from harness.processes import free_ports
from state import wait_until
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent / "node_red"
RECIPE = ROOT / "docs" / "examples" / "node-red.json"
OFFICE = SAMPLES / "office.jpg"
COUNT = re.compile(r"\[debug:show\] (\d+)")
PROBLEM = re.compile(r"\[debug:problem\]")
START_SECONDS = 60.0


class Snapshots(Handler):
    """A camera whose snapshot is the sample."""

    snapshot = OFFICE.read_bytes()

    def do_GET(self):
        """Sends the snapshot."""
        self.answer(200, self.snapshot, ("Content-Type", "image/jpeg"))


@contextlib.contextmanager
def node_red(folder: Path, environment: dict[str, str]) -> Iterator[Path]:
    """Runs the flow every second. Yields the file of the output."""
    flow = json.loads(RECIPE.read_text(encoding="utf-8"))
    (timer,) = [node for node in flow if node["type"] == "inject"]
    timer["repeat"] = "1"
    (folder / "flow.json").write_text(json.dumps(flow), encoding="utf-8")
    (port,) = free_ports(1)
    command = ["node", str(HERE / "node_modules/node-red/red.js"), "--userDir", str(folder), "--port", str(port)]
    command += ["-D", "uiHost=127.0.0.1", str(folder / "flow.json")]
    output = folder / "output.log"
    with output.open("wb") as log:
        process = subprocess.Popen(command, env=os.environ | environment, stdout=log, stderr=log)
        try:
            yield output
        finally:
            process.terminate()
            process.wait(timeout=START_SECONDS)


class NodeRed(unittest.TestCase):
    """The recipe as users import it."""

    @classmethod
    def setUpClass(cls) -> None:
        """Installs Node-RED according to the lock file."""
        command = ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error"]
        run(*command, cwd=HERE)

    def test_the_flow_counts_persons_and_shows_problems(self) -> None:
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        server, port = self.enterContext(lookdown({})), self.enterContext(serving(Snapshots))
        snapshot = f"http://127.0.0.1:{port}/snapshot.jpg"
        detect = f"http://{server.address}/detect?camera=hall&calibration=office&profile=fast"
        output = self.enterContext(node_red(folder, {"CAMERA_URL": snapshot, "LOOKDOWN_URL": detect}))
        wait_until(lambda: COUNT.search(output.read_text()), "the flow has counted", START_SECONDS)
        report = json.loads(server.get("/results/hall/latest"))
        self.assertGreater(len(report["persons"]), 3)
        self.assertEqual(int(COUNT.search(output.read_text())[1]), len(report["persons"]))
        self.assertIsNone(PROBLEM.search(output.read_text()))
        Snapshots.snapshot = b"no image"
        wait_until(lambda: PROBLEM.search(output.read_text()), "the flow shows the problem", START_SECONDS)


if __name__ == "__main__":
    unittest.main()
