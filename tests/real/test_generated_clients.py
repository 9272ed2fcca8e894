"""Clients generated from the OpenAPI document, compiled and run against a server."""

import json
import os
import shutil
import tempfile
import unittest
from pathlib import Path

from commands import run
from harness.places import ROOT, SAMPLES
from support.lookdown import lookdown

HERE = Path(__file__).resolve().parent / "generated_clients"
DOCUMENT = ROOT / "openapi" / "openapi.json"
ENVIRONMENT = ROOT / ".setup" / "real" / "generated_clients"
GENERATOR = ENVIRONMENT / "bin" / "openapi-generator-cli"
MODULES = HERE / "node_modules"
OFFICE = SAMPLES / "office.jpg"
# The generator is a Java program with Jackson, which its clients need.
JAVA = [f"/usr/share/java/{name}.jar" for name in ("httpclient", "httpcore", "httpmime", "commons-logging")]
JAVA.append("/usr/share/java/jakarta-annotation-api.jar")
JAVA_OPTIONS = "openApiNullable=false,useJakartaEe=true,useSingleRequestParameter=true"
STRICT = ["--strict", "--noEmit", "--skipLibCheck", "--target", "es2022", "--lib", "es2022,dom", "--module", "nodenext"]


class GeneratedClients(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        """Installs the generator and the compiler according to the lock file."""
        command = ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error"]
        run(*command, cwd=HERE)

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
        example = shutil.copy(ROOT / "docs" / "examples" / "detect.ts", self.folder)
        strict = [option for option in STRICT if option != "--noEmit"]
        self.succeeds(MODULES / ".bin/tsc", *strict, "--types", "node", "--typeRoots", MODULES / "@types", example)
        with lookdown({}) as server:
            lines = self.succeeds("node", self.folder / "detect.js", OFFICE, f"http://{server.address}").splitlines()
        self.assertGreater(len(lines), 3)

    def test_typescript_fetch_of_openapi_generator_detects_persons(self) -> None:
        sources = self.generated("typescript-fetch")
        shutil.copy(HERE / "detect.ts", sources)
        strict = [option for option in STRICT if option != "--noEmit"]
        files = map(str, sources.rglob("*.ts"))
        self.succeeds(MODULES / ".bin/tsc", *strict, "--types", "node", "--typeRoots", MODULES / "@types", *files)
        self.detects("node", sources / "detect.js")

    def test_python_of_openapi_generator_detects_persons(self) -> None:
        package = self.generated("python")
        self.detects(ENVIRONMENT / "bin" / "python", HERE / "detect.py", PYTHONPATH=package)

    def test_go_of_openapi_generator_detects_persons(self) -> None:
        module = self.generated("go")
        (module / "detect").mkdir()
        shutil.copy(HERE / "detect.go", module / "detect" / "main.go")
        # It needs the standard library only.
        self.succeeds("go", "build", "-mod=mod", "./...", cwd=module, GOPROXY="off", GOFLAGS="", GO111MODULE="on")
        self.succeeds("go", "build", "-o", self.folder / "detect", "./detect", cwd=module, GOPROXY="off")
        self.detects(self.folder / "detect")

    def test_java_of_openapi_generator_detects_persons(self) -> None:
        # `wait` is a method of every object.
        options = ["--library", "native", f"--additional-properties={JAVA_OPTIONS}"]
        sources = self.generated("java", *options, "--parameter-name-mappings", "wait=longPoll")
        (generator,) = ENVIRONMENT.rglob("openapi-generator.jar")
        path = ":".join([str(generator), *JAVA])
        classes, files = self.folder / "classes", (sources / "src" / "main").rglob("*.java")
        self.succeeds("javac", "-nowarn", "-proc:none", "-cp", path, "-d", classes, HERE / "Detect.java", *files)
        self.detects("java", "-cp", f"{classes}:{path}", "Detect")

    def detects(self, *command: object, **environment: object) -> None:
        """Runs a program with the address of a server and a frame with persons."""
        with lookdown({}) as server:
            persons = self.succeeds(*command, f"http://{server.address}", OFFICE, **environment)
        self.assertGreater(int(persons), 3)

    def generated(self, language: str, *options: str) -> Path:
        """Returns the folder of a client of openapi-generator."""
        folder = self.folder / language
        said = self.succeeds(GENERATOR, "generate", "-i", DOCUMENT, "-g", language, "-o", folder, *options)
        self.assertNotIn("[ERROR]", said)
        return folder

    def succeeds(self, *command: object, cwd: Path = ROOT, **environment: object) -> str:
        """Returns the output of a program."""
        return run(
            *command, cwd=cwd, environment=os.environ | {name: str(value) for name, value in environment.items()}
        )


if __name__ == "__main__":
    unittest.main()
