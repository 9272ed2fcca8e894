"""Shared code of the tests: an empty folder for each test, and captured output."""

import contextlib
import io
import tempfile
import unittest
from pathlib import Path


class InEmptyFolder(unittest.TestCase):
    """Gives each test `self.folder`, an empty folder whose path contains a space, and captures the output."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory(prefix="look down ")))
        self.printed = self.enterContext(contextlib.redirect_stdout(io.StringIO()))

    def write(self, name: str, content: bytes) -> Path:
        """Writes a file below the folder."""
        file = self.folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
        return file
