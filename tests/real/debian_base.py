"""A minimal Debian for the parts that need one: the base of the image, and the root of the package's tests."""

import shutil
from pathlib import Path

from commands import run
from harness.places import ROOT

RELEASE = "bookworm"
PLACE = ROOT / ".setup" / "real"


def debian_base(*packages: str) -> Path:
    """Returns the folder of a minimal Debian with these packages, which `debootstrap` creates on the first call."""
    place = PLACE / "-".join(["debian", *packages])
    if not place.is_dir():
        unfinished = place.with_name(f"{place.name}.unfinished")
        shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.parent.mkdir(parents=True, exist_ok=True)
        more = [f"--include={','.join(packages)}"] if packages else []
        run("debootstrap", "--variant=minbase", *more, RELEASE, unfinished, seconds=3600)
        for package in (unfinished / "var" / "cache" / "apt" / "archives").glob("*.deb"):
            package.unlink()
        unfinished.rename(place)
    return place
