"""Packs everything that Lookdown needs to run into target/dist: `dist.py [BINARY]`, target/release/lookdown by default.

The folder target/dist/lookdown is what container images are made of; the tarball beside it is the same for people.
The same binary and assets give the same bytes; files are as old as SOURCE_DATE_EPOCH says, from 1970 without it.
"""

import gzip
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

import sbom
from assets.machine import supported_cpu
from assets.runtime import LIBRARY, LICENSES, sha256_of

ROOT = Path(__file__).resolve().parents[2]
TEXTS = ("LICENSE", "NOTICE", "README.md", "CHANGELOG.md")
SETTINGS = "lookdown.toml"
SUMS = "SHA256SUMS"
BILL_OF_MATERIALS = "lookdown.cdx.json"
COMPLETIONS = {"bash": "lookdown.bash", "zsh": "_lookdown", "fish": "lookdown.fish"}


def main(arguments: list[str]) -> int:
    """Makes the folder and the tarball for this machine."""
    binary = Path(arguments[0]) if arguments else ROOT / "target" / "release" / "lookdown"
    make_dist(binary, supported_cpu(), ROOT / "runtime")
    return 0


def make_dist(binary: Path, cpu: str, runtime: Path, emulator: Sequence[str] = ()) -> None:
    """Makes the folder and the tarball for a processor, with the ONNX Runtime in the folder `runtime`.

    The command `emulator` runs a binary of that processor here.
    """
    manifest = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
    place = ROOT / "target" / "dist"
    folder = place / "lookdown"
    shutil.rmtree(place, ignore_errors=True)
    copy_files(folder, binary, files_of(ROOT, runtime))
    describe_commands(folder, emulator)
    sbom.main([str(folder / BILL_OF_MATERIALS)])
    write_sums(folder)
    tarball = place / f"lookdown-{manifest['version']}-linux-{cpu}.tar.gz"
    pack(folder, tarball, int(os.environ.get("SOURCE_DATE_EPOCH", "0")))
    sums = tarball.with_name(f"{tarball.name}.sha256")
    sums.write_text(f"{sha256_of(tarball)}  {tarball.name}\n", encoding="utf-8")
    print(f"{tarball.relative_to(ROOT)}: {tarball.stat().st_size / 1e6:.1f} MB")


def files_of(root: Path, runtime: Path) -> Iterator[tuple[Path, str]]:
    """The files of the set-up and of the repository, with their names in the folder."""
    for name in TEXTS:
        yield root / name, name
    yield root / "packaging" / SETTINGS, SETTINGS
    for name in (LIBRARY, *LICENSES):
        yield runtime / name, f"runtime/{name}"
    yield from model_files(root)


def model_files(root: Path) -> Iterator[tuple[Path, str]]:
    """Our networks with the license of their origin, with their names in a package."""
    for model in sbom.MODELS:
        for name in ("model.toml", "model.onnx", "LICENSE-package"):
            yield root / "models" / model / name, f"models/{model}/{name}"


def copy_files(folder: Path, binary: Path, files: Iterator[tuple[Path, str]]) -> None:
    """Copies them with the permissions that all files need."""
    for source, name in [(binary, "lookdown"), *files]:
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            shutil.copyfile(source, target)
        except FileNotFoundError:
            sys.exit(f"{source} is missing; run `make setup` first.")
        target.chmod(0o755 if source == binary else 0o644)


def describe_commands(folder: Path, emulator: Sequence[str] = ()) -> None:
    """Lets the binary write its manual and shell completions."""
    binary = [*emulator, folder / "lookdown"]
    subprocess.run([*binary, "manual", folder / "man" / "man1"], check=True)
    completions = folder / "completions"
    completions.mkdir()
    for shell, name in COMPLETIONS.items():
        script = subprocess.run([*binary, "completions", shell], check=True, capture_output=True).stdout
        (completions / name).write_bytes(script)


def write_sums(folder: Path) -> None:
    """Writes SHA256SUMS for `sha256sum --check` in the folder."""
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    lines = [f"{sha256_of(file)}  {file.relative_to(folder)}\n" for file in files]
    (folder / SUMS).write_text("".join(lines), encoding="utf-8")


def pack(folder: Path, tarball: Path, modified: int) -> None:
    """Packs the folder reproducibly, under the name of the tarball."""

    def anonymous(entry: tarfile.TarInfo) -> tarfile.TarInfo:
        entry.uid = entry.gid = 0
        entry.uname = entry.gname = ""
        entry.mtime = modified
        return entry

    with (
        open(tarball, "wb") as file,
        gzip.GzipFile("", "wb", mtime=modified, fileobj=file) as compressed,
        tarfile.open(fileobj=compressed, mode="w") as packed,
    ):
        # Members are sorted by name.
        packed.add(folder, tarball.name.removesuffix(".tar.gz"), filter=anonymous)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
