"""Clients generated from the OpenAPI document: TypeScript with a real server, and those of openapi-generator."""

import json
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from harness.places import ROOT, SAMPLES
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent / "generated_clients"
DOCUMENT = ROOT / "openapi" / "openapi.json"
GENERATOR = ROOT / ".setup" / "real" / "generated_clients" / "bin" / "openapi-generator-cli"
MODULES = HERE / "node_modules"
OFFICE = SAMPLES / "office.jpg"
STRICT = ["--strict", "--noEmit", "--skipLibCheck", "--target", "es2022", "--lib", "es2022,dom", "--module", "nodenext"]


class GeneratedClients(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        """Installs the generator and the compiler according to the lock file."""
        command = ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error"]
        subprocess.run(command, cwd=HERE, check=True)

    def setUp(self) -> None:
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def test_openapi_fetch_compiles_and_detects_persons(self) -> None:
        for name in ("client.ts", "tsconfig.json", "package.json"):
            shutil.copy(HERE / name, self.folder)
        (self.folder / "node_modules").symlink_to(MODULES)
        self.succeeds(MODULES / ".bin/openapi-typescript", DOCUMENT, "-o", self.folder / "schema.d.ts")
        self.succeeds(MODULES / ".bin/tsc", "-p", self.folder)
        with lookdown({}) as server:
            answer = json.loads(self.succeeds("node", self.folder / "client.js", server.address, "no-key", OFFICE))
        self.assertGreater(answer["persons"], 3)
        self.assertEqual(answer["latest"], answer["persons"])
        self.assertEqual(answer["refused"], "/problems/unknown-calibration")
        self.assertIn("office", answer["calibrations"])

    def test_the_example_in_typescript_compiles_and_prints_persons(self) -> None:
        (self.folder / "node_modules").symlink_to(MODULES)
        (self.folder / "package.json").write_text('{"type": "module"}', encoding="utf-8")
        example = shutil.copy(ROOT / "examples" / "detect.ts", self.folder)
        strict = [option for option in STRICT if option != "--noEmit"]
        self.succeeds(MODULES / ".bin/tsc", *strict, "--types", "node", "--typeRoots", MODULES / "@types", example)
        with lookdown({}) as server:
            lines = self.succeeds("node", self.folder / "detect.js", OFFICE, f"http://{server.address}").splitlines()
        self.assertGreater(len(lines), 3)

    def test_typescript_fetch_of_openapi_generator_compiles(self) -> None:
        sources = self.generated("typescript-fetch")
        self.assertIn("img: Blob;", (sources / "apis" / "DetectionApi.ts").read_text(encoding="utf-8"))
        files = map(str, sources.rglob("*.ts"))
        self.succeeds(MODULES / ".bin/tsc", *STRICT, "--types", "node", "--typeRoots", MODULES / "@types", *files)

    def test_python_of_openapi_generator_compiles(self) -> None:
        package = self.generated("python")
        self.succeeds("python3", "-m", "compileall", "-q", package / "openapi_client")

    def test_go_and_java_are_generated(self) -> None:
        for language, file in (("go", "model_report.go"), ("java", "Report.java")):
            with self.subTest(language):
                self.assertTrue(list(self.generated(language).rglob(file)))

    def generated(self, language: str) -> Path:
        """Returns the folder of a client of openapi-generator."""
        folder = self.folder / language
        said = self.succeeds(GENERATOR, "generate", "-i", DOCUMENT, "-g", language, "-o", folder)
        self.assertNotIn("[ERROR]", said)
        return folder

    def succeeds(self, *command: object) -> str:
        """Returns the output of a program."""
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout


if __name__ == "__main__":
    unittest.main()
