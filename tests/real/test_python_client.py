"""A Python client generated from the OpenAPI document, by openapi-python-client from PyPI, with a real server."""

import hashlib
import json
import os
import shutil
import tempfile
import unittest
from pathlib import Path
from urllib.request import Request, urlopen

from commands import run
from harness.places import ROOT, SAMPLES
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent
BIN = ROOT / ".setup" / "real" / "python_client" / "bin"
OFFICE = SAMPLES / "office.jpg"
KEY = "lookdown_of_a_client"


class GeneratedClient(unittest.TestCase):
    """The generated client."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        config = self.folder / "config.yml"
        # As in docs/python-client.md. The hooks would format the generated code.
        config.write_text(
            "content_type_overrides: {image/jpeg: application/octet-stream, "
            "multipart/x-mixed-replace: application/octet-stream}\npost_hooks: []\n",
            encoding="utf-8",
        )
        command = ["generate", "--fail-on-warning", "--config", config, "--output-path", self.folder / "client"]
        document = ROOT / "openapi" / "openapi.json"
        self.generated = run(BIN / "openapi-python-client", *command, "--path", document)

    def python(self, *arguments: str) -> str:
        """The output of a program that uses the client."""
        return run(BIN / "python", *arguments, environment=os.environ | {"PYTHONPATH": str(self.folder / "client")})

    def test_it_is_generated_without_warnings_and_works(self):
        self.assertNotIn("warning", self.generated.lower())
        calibrations = self.folder / "calibrations"
        shutil.copytree(SAMPLES / "calibrations", calibrations)
        digest = hashlib.sha256(KEY.encode()).hexdigest()
        with lookdown({"ACCESS__KEYS": f"client:admin:{digest}"}, calibrations=calibrations) as server:
            answer = json.loads(self.python(str(HERE / "python_client.py"), server.address, KEY, str(OFFICE)))
            request = Request(f"http://{server.address}/results/office/latest", headers={"X-API-Key": KEY})
            with urlopen(request, timeout=60) as latest:
                report = json.load(latest)
        self.assertEqual(set(answer["persons"]), {len(report["persons"])})
        self.assertGreater(answer["predictions"], 0)
        self.assertEqual(answer["best"], report["persons"][0])
        self.assertIn("unknown-id", answer["refused"])
        self.assertIn("office", answer["calibrations"])
        self.assertEqual(set(answer["cameras"]), {"office", "copy"})
        self.assertEqual(answer["past"], 3)
        self.assertTrue((calibrations / "copy.json").is_file())

    def test_the_example_in_the_documentation_works(self):
        text = (ROOT / "docs" / "python-client.md").read_text(encoding="utf-8")
        example = text.split("```python\n")[1].split("```")[0]
        with lookdown({}) as server:
            program = self.folder / "example.py"
            program.write_text(example.replace("localhost:8080", server.address), encoding="utf-8")
            printed = self.python(str(program))
        self.assertIn("office equidistant", printed)
        self.assertGreater(int(printed.splitlines()[-1]), 0)
