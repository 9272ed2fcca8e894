"""Packs target/dist/lookdown into a Debian package in target/deb: `deb.py`, after `dist.py`.

The folder `packaging/debian` describes the package; debhelper builds it. The changelog and the copyright file of the package are
written here, from the version of the crate, NOTICE and the licenses of the packed files.
"""

import os
import shutil
import subprocess
import sys
import tomllib
from email.utils import formatdate
from pathlib import Path

from dist import ROOT

DIST = ROOT / "target" / "dist" / "lookdown"
PLACE = ROOT / "target" / "deb"
REVISION = 1
"""The revision of the package of one version of Lookdown."""
CHANGELOG = """\
lookdown ({version}) unstable; urgency=medium

  * Build of Lookdown {upstream}; changelog.gz lists its changes.

 -- {maintainer}  {date}
"""
APACHE = "TERMS AND CONDITIONS FOR USE, REPRODUCTION, AND DISTRIBUTION"
"""A line of the Apache License, whose text Debian has in /usr/share/common-licenses."""
HEAD = """\
Copyright 2026 The Lookdown authors

Lookdown is licensed under the Apache License, Version 2.0; see
/usr/share/common-licenses/Apache-2.0. The Rust packages inside the program are
listed with their licenses in /usr/share/doc/lookdown/lookdown.cdx.json.gz.
"""


def main() -> int:
    """Builds the package."""
    if not (DIST / "lookdown").is_file():
        sys.exit("target/dist/lookdown is missing; run `make dist` first.")
    shutil.rmtree(PLACE, ignore_errors=True)
    source = PLACE / "source"
    shutil.copytree(DIST, source)
    shutil.copytree(ROOT / "packaging/debian", source / "debian")
    modified = int(os.environ.get("SOURCE_DATE_EPOCH", (DIST / "lookdown").stat().st_mtime))
    (source / "debian" / "changelog").write_text(changelog(ROOT, modified), encoding="utf-8")
    (source / "debian" / "copyright").write_text(copyright_of(DIST), encoding="utf-8")
    built = subprocess.run(["debian/rules", "binary"], cwd=source, check=False)
    if built.returncode != 0:
        return built.returncode
    shutil.rmtree(source)
    (package,) = PLACE.glob("*.deb")
    print(f"{package.relative_to(ROOT)}: {package.stat().st_size / 1e6:.1f} MB")
    return 0


def changelog(root: Path, modified: int) -> str:
    """The changelog of the package; the changes of Lookdown are in CHANGELOG.md."""
    manifest = tomllib.loads((root / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
    control = (root / "packaging/debian/control").read_text(encoding="utf-8").splitlines()
    (maintainer,) = (line.removeprefix("Maintainer: ") for line in control if line.startswith("Maintainer: "))
    upstream = manifest["version"]
    version = f"{upstream}-{REVISION}"
    return CHANGELOG.format(version=version, upstream=upstream, maintainer=maintainer, date=formatdate(modified))


def copyright_of(dist: Path) -> str:
    """The notices of all packed works, and the licenses whose text is not part of every Debian."""
    files = [dist / "NOTICE", dist / "runtime" / "LICENSE", *sorted(dist.glob("models/*/LICENSE-*"))]
    texts = {file: file.read_text(encoding="utf-8") for file in files}
    sections = (f"{file.relative_to(dist)}\n\n{text}" for file, text in texts.items() if APACHE not in text)
    return "\n--------\n\n".join([HEAD, *sections])


if __name__ == "__main__":
    sys.exit(main())
