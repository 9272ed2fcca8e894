"""The changelog, the copyright file and the units of the Debian package."""

import tempfile
import tomllib
import unittest
from pathlib import Path

from deb import changelog, copyright_of
from dist import ROOT


class Deb(unittest.TestCase):
    def test_changelog_has_version_maintainer_and_time(self):
        manifest = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
        first, *_, last = changelog(ROOT, 1_000_000_000).strip().splitlines()
        self.assertEqual(first, f"lookdown ({manifest['version']}-1) unstable; urgency=medium")
        self.assertRegex(last, r"^ -- [\w ]+ <\S+@\S+>  Sun, 09 Sep 2001 01:46:40 -0000$")

    def test_copyright_has_notices_and_licences_that_debian_lacks(self):
        dist = Path(self.enterContext(tempfile.TemporaryDirectory()))
        texts = {
            "NOTICE": "the notices",
            "runtime/LICENSE": "MIT License",
            "models/one/LICENSE-package": "the license of a package",
            "models/two/LICENSE-weights": (ROOT / "LICENSE").read_text(encoding="utf-8"),
        }
        for name, text in texts.items():
            (dist / name).parent.mkdir(parents=True, exist_ok=True)
            (dist / name).write_text(text, encoding="utf-8")
        text = copyright_of(dist)
        for part in ("/usr/share/common-licenses/Apache-2.0", "the notices", "MIT License", "models/one"):
            self.assertIn(part, text)
        self.assertNotIn("models/two", text)

    def test_each_unit_limits_its_memory(self):
        units = sorted((ROOT / "packaging" / "debian").glob("*.service"))
        self.assertEqual(len(units), 3)
        for unit in units:
            self.assertIn("\nMemoryMax=", unit.read_text(encoding="utf-8"), unit.name)


if __name__ == "__main__":
    unittest.main()
