"""The checkers that need Node.js: Redocly for the OpenAPI documents, Biome for the JavaScript."""

import subprocess
import unittest
from pathlib import Path

from harness.places import ROOT

HERE = Path(__file__).resolve().parent / "checkers"


class Checkers(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        """Installs the checkers according to the lock file."""
        command = ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error"]
        subprocess.run(command, cwd=HERE, check=True)

    def test_the_openapi_documents_follow_the_recommended_rules(self) -> None:
        documents = ("openapi/openapi.json", "openapi/counts.json")
        self.run_checker(HERE / "node_modules/.bin/redocly", "lint", *documents)

    def test_the_scripts_of_the_page_have_no_lint(self) -> None:
        scripts = [*sorted(ROOT.glob("web/*.js")), *sorted(ROOT.glob("tests/real/page/*.js"))]
        (biome,) = HERE.glob("node_modules/@biomejs/cli-*/biome")
        self.run_checker(biome, "lint", "--error-on-warnings", *map(str, scripts))

    def run_checker(self, program: Path, *arguments: str) -> None:
        done = subprocess.run([program, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
