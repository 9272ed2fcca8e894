"""The crates that are published: their metadata, their files, and what they depend on."""

import json
import subprocess
import unittest

from dist import ROOT

# Sources and small tables only: no weights, images or fixtures.
MAX_FILE_BYTES = 200_000


def cargo(*arguments: str) -> str:
    command = ["cargo", *arguments, "--offline"]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def published() -> dict[str, dict]:
    """The crates of the workspace without `publish = false`, by name."""
    metadata = json.loads(cargo("metadata", "--no-deps", "--format-version", "1"))
    return {package["name"]: package for package in metadata["packages"] if package["publish"] != []}


class Crates(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.crates = published()

    def test_the_libraries_for_others_are_published(self):
        names = ("common", "lens", "calibration", "imaging", "detect", "tracking", "eval")
        libraries = {f"lookdown-{name}" for name in names}
        self.assertLessEqual(libraries, {*self.crates})

    def test_metadata_of_published_crates_is_complete(self):
        for name, crate in self.crates.items():
            for field in ("description", "license", "documentation", "readme", "rust_version"):
                self.assertTrue(crate[field], f"{name}: {field}")

    def test_published_crates_depend_on_published_crates_only(self):
        for name, crate in self.crates.items():
            own = (needed["name"] for needed in crate["dependencies"] if "path" in needed and needed["kind"] != "dev")
            self.assertEqual({*own} - {*self.crates}, set(), f"{name}: crates.io refuses it")

    def test_packages_hold_the_license_and_no_large_files(self):
        for name in self.crates:
            folder = ROOT / "crates" / name
            files = cargo("package", "--package", name, "--list", "--allow-dirty").split("\n")
            self.assertLessEqual({"LICENSE", "README.md", "Cargo.toml", "src/lib.rs"}, {*files}, name)
            own = (folder / file for file in files if file)
            large = [str(file) for file in own if file.is_file() and file.stat().st_size > MAX_FILE_BYTES]
            self.assertEqual(large, [], f"{name}: exclude them")


if __name__ == "__main__":
    unittest.main()
