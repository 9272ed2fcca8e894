"""The checkers that need Node.js: Redocly for the OpenAPI document, Biome for the JavaScript."""

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

    def test_the_openapi_document_follows_the_recommended_rules(self) -> None:
        self.run_checker("redocly", "lint", "openapi/openapi.json")

    def test_the_scripts_of_the_page_have_no_lint(self) -> None:
        scripts = [*sorted(ROOT.glob("web/*.js")), *sorted(ROOT.glob("tests/real/page/*.js"))]
        self.run_checker("biome", "lint", "--error-on-warnings", *map(str, scripts))

    def run_checker(self, name: str, *arguments: str) -> None:
        command = [str(HERE / "node_modules" / ".bin" / name), *arguments]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
