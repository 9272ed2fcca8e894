"""The web page in Debian's Chromium, driven by Playwright, and its calculations in Node.

`LOOKDOWN_PAGE_PICTURES=docs/images make real PARTS=page` updates the screenshots in docs/images.
"""

import hashlib
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from support.lookdown import lookdown
from support.places import FIXTURES, ROOT, SAMPLES

HERE = Path(__file__).resolve().parent / "page"
KEY = "a key that only this test knows"
PICTURED = "gate,office,canteen,lounge"
"""Cameras whose images are kept."""


class Page(unittest.TestCase):
    """The actions and views of a visitor."""

    @classmethod
    def setUpClass(cls) -> None:
        """Installs the browser driver according to the lock file."""
        environment = os.environ | {"PLAYWRIGHT_SKIP_BROWSER_DOWNLOAD": "1"}
        subprocess.run(
            ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error"],
            cwd=HERE,
            env=environment,
            check=True,
        )

    def test_the_calculations_of_the_page(self) -> None:
        self.run_node("maths.test.js", {})

    def test_the_page_in_a_browser(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            calibrations = Path(folder) / "calibrations"
            shutil.copytree(SAMPLES / "calibrations", calibrations)
            keys = Path(folder) / "keys.toml"
            digest = hashlib.sha256(KEY.encode()).hexdigest()
            keys.write_text(
                f'page = {{ scopes = ["detect", "read", "admin"], sha256 = "{digest}" }}\n', encoding="utf-8"
            )
            with lookdown({"RESULTS__PICTURES": PICTURED}, calibrations=calibrations) as server:
                with lookdown({"ACCESS__KEYS_FILE": str(keys)}) as keyed:
                    self.run_node(
                        "all.test.js",
                        {
                            "LOOKDOWN_URL": f"http://{server.address}",
                            "LOOKDOWN_KEYED_URL": f"http://{keyed.address}",
                            "LOOKDOWN_KEY": KEY,
                            "LOOKDOWN_SAMPLES": str(SAMPLES),
                            "LOOKDOWN_FIXTURES": str(FIXTURES / "calibrations"),
                        },
                    )

    def run_node(self, tests: str, settings: dict[str, str]) -> None:
        """Runs tests that are written in JavaScript."""
        pictures = os.environ.get("LOOKDOWN_PAGE_PICTURES")
        if pictures:
            settings = settings | {"LOOKDOWN_PAGE_PICTURES": str(ROOT / pictures)}
        done = subprocess.run(["node", "--test", tests], cwd=HERE, env=os.environ | settings, check=False)
        self.assertEqual(done.returncode, 0, f"{tests}: see above")


if __name__ == "__main__":
    unittest.main()
