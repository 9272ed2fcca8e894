"""Builds the image from docker/Dockerfile with buildah, with the existing release binary."""

import json
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from commands import run
from debian import debian_base
from harness.places import LOOKDOWN, ROOT

HERE = ROOT / ".setup" / "real" / "image"
STORE = HERE / "store"
# Required by buildah as root in a container that is not privileged.
BUILDAH = ["buildah", f"--root={STORE}/images", f"--runroot={STORE}/run", "--storage-driver=vfs"]
INSIDE = Path(__file__).with_name("inside.sh")
BUILD_ARGUMENTS = {
    "PROGRAM": "prebuilt",
    "LOOKDOWN_COMMIT": "0123456789ab",
    "CREATED": "2026-11-22T12:00:00Z",
    "SOURCE_URL": "https://forge.example/lookdown",
}


@dataclass(frozen=True)
class Image:
    """An image and its files."""

    root: Path
    config: dict

    def inside(self, *command: str, **variables: str) -> list[str]:
        """The command line that runs a command in the image, with the image's environment and these variables."""
        environment = dict(variable.split("=", 1) for variable in self.config["Env"]) | variables
        assignments = [f"{name}={value}" for name, value in environment.items()]
        isolated = ["/usr/bin/unshare", "--mount", "/bin/sh", str(INSIDE), str(self.root)]
        return ["env", "-i", *assignments, *isolated, *command]

    def user(self) -> int:
        """The number of its user."""
        return int(self.config["User"].split(":")[0])

    def size(self) -> int:
        """The total size of all files, bytes."""
        files = (file for file in self.root.rglob("*") if file.is_file() and not file.is_symlink())
        return sum(file.stat().st_size for file in files)


def build(*targets: str) -> list[Image]:
    """Builds an image for each target of the Dockerfile. They stay until `remove` is called."""
    remove()
    run(sys.executable, ROOT / "packaging" / "scripts" / "dist.py", LOOKDOWN)
    _import_base("debian:12-slim")
    return [_build(target) for target in targets]


def _build(target: str) -> Image:
    _buildah(
        # Layers are kept, so that the second target starts with those of the first.
        *("bud", "--isolation=chroot", "--pull-never", "--format=docker", "--layers", f"--target={target}"),
        *(f"--build-arg={name}={value}" for name, value in BUILD_ARGUMENTS.items()),
        *(f"--file={ROOT}/docker/Dockerfile", f"--tag=lookdown-{target}", ROOT),
    )
    container = _buildah("from", "--pull-never", f"lookdown-{target}")
    root = Path(_buildah("mount", container))
    # Container engines mount these.
    for place in ("dev", "proc"):
        (root / place).mkdir()
    return Image(root, json.loads(_buildah("inspect", container))["Docker"]["config"])


def remove() -> None:
    """Deletes everything that was built, except the base."""
    shutil.rmtree(STORE, ignore_errors=True)


def _import_base(name: str) -> None:
    container = _buildah("from", "scratch")
    _buildah("add", "--quiet", container, debian_base(), "/")
    _buildah("commit", "--quiet", "--rm", container, name)


def _buildah(*arguments) -> str:
    return run(*BUILDAH, *arguments, seconds=3600).strip()
