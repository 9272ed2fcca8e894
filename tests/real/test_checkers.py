"""Checkers: Redocly for the OpenAPI documents, Biome for the JavaScript, schemas for the files of `.github`."""

import unittest
from pathlib import Path

from commands import run
from harness.places import ROOT

HERE = Path(__file__).resolve().parent / "checkers"
CHECK = ROOT / ".setup" / "real" / "workflows" / "bin" / "check-jsonschema"
# The files of `.github` that a forge reads, by the name of their schema.
OF_SCHEMA = {
    "github-workflows": "workflows/*.yml",
    "dependabot": "dependabot.yml",
    "github-issue-forms": "ISSUE_TEMPLATE/[!c]*.yml",
    "github-issue-config": "ISSUE_TEMPLATE/config.yml",
}


class Checkers(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        """Installs the checkers according to the lock file."""
        command = ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error"]
        run(*command, cwd=HERE)

    def test_the_openapi_documents_follow_the_recommended_rules(self) -> None:
        documents = ("openapi/openapi.json", "openapi/counts.json")
        run(HERE / "node_modules/.bin/redocly", "lint", *documents)

    def test_the_scripts_of_the_page_have_no_lint(self) -> None:
        scripts = [*sorted(ROOT.glob("web/*.js")), *sorted(ROOT.glob("tests/real/page/*.js"))]
        (biome,) = HERE.glob("node_modules/@biomejs/cli-*/biome")
        run(biome, "lint", "--error-on-warnings", *scripts)

    def test_the_files_of_the_forge_follow_their_schemas(self) -> None:
        for schema, pattern in OF_SCHEMA.items():
            files = sorted((ROOT / ".github").glob(pattern))
            self.assertTrue(files, pattern)
            run(CHECK, "--builtin-schema", f"vendor.{schema}", *files)


if __name__ == "__main__":
    unittest.main()
