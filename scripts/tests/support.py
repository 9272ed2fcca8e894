"""Shared code of the tests: a repository for each test, and small archives."""

import contextlib
import dataclasses
import hashlib
import io
import tarfile
import tempfile
import unittest
import zipfile
from pathlib import Path

from assets.pins import Archive, Member, Model
from assets.places import Places


class InEmptyRepository(unittest.TestCase):
    """Gives each test `self.places` in an empty folder whose path contains a space, and captures the output."""

    def setUp(self):
        folder = self.enterContext(tempfile.TemporaryDirectory(prefix="look down "))
        self.places = Places(Path(folder))
        self.places.own.mkdir()
        self.printed = self.enterContext(contextlib.redirect_stdout(io.StringIO()))

    def write(self, name: str, content: bytes) -> Path:
        """Writes a file of the repository."""
        file = self.places.root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
        return file


def sha256(content: bytes) -> str:
    """The sum of some bytes."""
    return hashlib.sha256(content).hexdigest()


def archive_of(content: bytes, file: str = "thing-1.0.tgz") -> Archive:
    """The pin of an archive with this content."""
    return Archive("thing", "1.0", file, len(content), sha256(content))


def model_of(archive: Archive, members: tuple[Member, ...], onnx: bytes, **changes) -> Model:
    """The pin of a model from an archive that is converted to these bytes."""
    model = Model("net", archive, "npm", members, ("convert.net",), sha256(onnx), default=True, caution=None)
    return dataclasses.replace(model, **changes)


def wheel(files: dict[str, bytes]) -> bytes:
    """A wheel (zip) with these files."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, content in files.items():
            opened.writestr(name, content)
    return buffer.getvalue()


def npm_package(files: dict[str, bytes]) -> bytes:
    """An npm package (gzipped tar) with these files."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz") as opened:
        for name, content in files.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            opened.addfile(entry, io.BytesIO(content))
    return buffer.getvalue()


def member(path: str, content: bytes, to: str | None = None) -> Member:
    """The pin of a file in an archive."""
    return Member(path, sha256(content), to)
