"""The tarball is complete, verifiable and reproducible."""

import hashlib
import subprocess
import tarfile
import tempfile
import unittest
from pathlib import Path

from dist import ROOT, copy_files, describe_commands, files_of, pack, write_sums
from sbom import MODELS

PROGRAM = """#!/bin/sh
if [ "$1" = manual ]; then mkdir -p "$2" && echo page > "$2/lookdown.1"; else echo "complete $2"; fi
"""


class Dist(unittest.TestCase):
    def setUp(self):
        self.here = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.folder = self.here / "lookdown"
        self.binary = self.here / "built"
        self.binary.write_text(PROGRAM, encoding="utf-8")

    def test_tarball_has_library_networks_and_licenses(self):
        names = [name for _, name in files_of(ROOT, self.here)]
        for name in ("LICENSE", "NOTICE", "runtime/libonnxruntime.so", "runtime/ThirdPartyNotices.txt"):
            self.assertIn(name, names)
        models = {name.split("/")[1] for name in names if name.endswith("/model.onnx")}
        self.assertEqual(models, {*MODELS})

    def test_another_processor_has_its_own_library_and_emulator(self):
        sources = {name: source for source, name in files_of(ROOT, self.here / "runtime")}
        self.assertEqual(sources["runtime/libonnxruntime.so"], self.here / "runtime/libonnxruntime.so")
        self.assertEqual(sources["LICENSE"], ROOT / "LICENSE")
        copy_files(self.folder, self.binary, iter(()))
        (self.folder / "lookdown").chmod(0o644)
        describe_commands(self.folder, ["sh"])
        self.assertTrue((self.folder / "man/man1/lookdown.1").is_file())

    def test_a_file_that_is_missing_is_named(self):
        with self.assertRaises(SystemExit) as refused:
            copy_files(self.folder, self.binary, iter([(self.here / "gone.so", "gone.so")]))
        self.assertIn("gone.so is missing", str(refused.exception))

    def test_every_file_is_in_the_sums(self):
        copy_files(self.folder, self.binary, iter(()))
        describe_commands(self.folder)
        write_sums(self.folder)
        check = ["sha256sum", "--check", "--strict", "SHA256SUMS"]
        checked = subprocess.run(check, cwd=self.folder, check=True, capture_output=True, text=True)
        names = {line.rsplit(":", 1)[0] for line in checked.stdout.splitlines()}
        completions = {f"completions/{name}" for name in ("lookdown.bash", "_lookdown", "lookdown.fish")}
        self.assertEqual(names, {"lookdown", "man/man1/lookdown.1"} | completions)

    def test_the_same_files_make_the_same_tarball(self):
        sums = []
        for name in ("first", "second"):
            folder = self.here / name / "lookdown"
            copy_files(folder, self.binary, iter(()))
            tarball = self.here / name / "lookdown-1-linux.tar.gz"
            pack(folder, tarball, 1_000_000_000)
            sums.append(hashlib.sha256(tarball.read_bytes()).hexdigest())
            with tarfile.open(tarball) as packed:
                entry = packed.getmember("lookdown-1-linux/lookdown")
                self.assertEqual((entry.mode, entry.uid, entry.mtime), (0o755, 0, 1_000_000_000))
        self.assertEqual(sums[0], sums[1])


if __name__ == "__main__":
    unittest.main()
