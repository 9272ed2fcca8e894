"""A program outside of this repository that depends on the libraries of lenses and calibrations, and the packages of the libraries."""

import math
import shutil
import tempfile
import unittest
from pathlib import Path

from commands import run
from harness.places import ROOT

CRATES = ROOT / "crates"
LIBRARIES = ("lookdown-lens", "lookdown-calibration")
PROGRAM = Path(__file__).resolve().parent / "lens_library" / "main.rs"
CAMCHAIN = ROOT / "tests" / "fixtures" / "calibrations" / "kalibr_camchain.yaml"
TARGET = ROOT / "target" / "lens-library"
FX, FY, CX, CY = 190.97847715128717, 190.9733070521226, 254.93170605935475, 256.8974428996504
K = (0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182)
"""The first camera of the file."""


class LensLibrary(unittest.TestCase):
    """The library for others."""

    def test_a_program_elsewhere_projects_through_a_kalibr_file(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "src").mkdir()
        shutil.copyfile(PROGRAM, folder / "src" / "main.rs")
        # The versions that were tested, and fetched already.
        shutil.copyfile(ROOT / "Cargo.lock", folder / "Cargo.lock")
        (folder / "Cargo.toml").write_text(
            '[package]\nname = "program"\nversion = "0.1.0"\nedition = "2024"\n\n[dependencies]\n'
            + "".join(f'{name} = {{ path = "{CRATES / name}" }}\n' for name in LIBRARIES),
            encoding="utf-8",
        )
        said = cargo("run", "--quiet", "--", CAMCHAIN, "kalibr-cam0", cwd=folder)
        for line, degrees in zip(said.splitlines(), (0.0, 30.0, 60.0), strict=True):
            # Kannala and Brandt, as Kalibr's documentation of its equidistant distortion has it.
            theta = math.radians(degrees)
            distorted = theta * (1 + sum(k * theta ** (2 * power) for power, k in enumerate(K, start=1)))
            x, y = map(float, line.split())
            self.assertAlmostEqual(x, FX * distorted + CX, places=9)
            self.assertAlmostEqual(y, CY, places=9)

    def test_the_libraries_can_be_packaged(self):
        names = ("common", "lens", "calibration", "imaging", "tracking", "detect", "eval")
        chosen = [f"--package=lookdown-{name}" for name in names]
        cargo("package", "--allow-dirty", "--no-verify", "--offline", *chosen, cwd=ROOT)


def cargo(subcommand: str, *arguments: str | Path, cwd: Path) -> str:
    """Returns the output of cargo, which must succeed."""
    return run("cargo", subcommand, "--target-dir", TARGET, *arguments, cwd=cwd, seconds=900)


if __name__ == "__main__":
    unittest.main()
