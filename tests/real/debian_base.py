"""A minimal Debian for the parts that need one: the base of the image, and the root of the package's tests."""

import shutil
import subprocess
from pathlib import Path

from harness.places import ROOT

RELEASE = "bookworm"
PLACE = ROOT / ".setup" / "real"


class DebianError(Exception):
    """A failed creation of the folder, with the output of `debootstrap`."""


def debian_base(*packages: str) -> Path:
    """Returns the folder of a minimal Debian with these packages, which `debootstrap` creates on the first call."""
    place = PLACE / "-".join(["debian", *packages])
    if not place.is_dir():
        unfinished = place.with_name(f"{place.name}.unfinished")
        shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.parent.mkdir(parents=True, exist_ok=True)
        more = [f"--include={','.join(packages)}"] if packages else []
        command = ["debootstrap", "--variant=minbase", *more, RELEASE, unfinished]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise DebianError(f"debootstrap failed:\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
        for package in (unfinished / "var" / "cache" / "apt" / "archives").glob("*.deb"):
            package.unlink()
        unfinished.rename(place)
    return place
