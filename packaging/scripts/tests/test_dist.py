"""The tarball is complete, verifiable and reproducible. The Debian package, and the version in all files."""

import hashlib
import re
import subprocess
import tarfile
import tempfile
import tomllib
import unittest
from pathlib import Path

from assets.runtime import pinned_runtime
from deb import changelog, copyright_of
from dist import ROOT, copy_files, describe_commands, files_of, pack, write_sums
from sbom import MODELS

PROGRAM = """#!/bin/sh
if [ "$1" = manual ]; then mkdir -p "$2" && echo page > "$2/lookdown.1"; else echo "complete $2"; fi
"""

OWN = ("docker/Dockerfile", "docker/Dockerfile.cuda", "docker/compose.yaml", "k8s/base/kustomization.yaml")
STATED = re.compile(r"(?:lookdown(?:-cuda)?:|image\.version=\"|newTag: |kubernetes\.io/version: )(\d[\w.-]*)")


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


class Deb(unittest.TestCase):
    def test_changelog_has_version_maintainer_and_time(self):
        manifest = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
        first, *_, last = changelog(ROOT, 1_000_000_000).strip().splitlines()
        self.assertEqual(first, f"lookdown ({manifest['version']}-1) unstable; urgency=medium")
        self.assertRegex(last, r"^ -- [\w ]+ <\S+@\S+>  Sun, 09 Sep 2001 01:46:40 -0000$")

    def test_copyright_has_notices_and_licences_that_debian_lacks(self):
        dist = Path(self.enterContext(tempfile.TemporaryDirectory()))
        texts = {
            "NOTICE": "the notices",
            "runtime/LICENSE": "MIT License",
            "models/one/LICENSE-package": "the license of a package",
            "models/two/LICENSE-weights": (ROOT / "LICENSE").read_text(encoding="utf-8"),
        }
        for name, text in texts.items():
            (dist / name).parent.mkdir(parents=True, exist_ok=True)
            (dist / name).write_text(text, encoding="utf-8")
        text = copyright_of(dist)
        for part in ("/usr/share/common-licenses/Apache-2.0", "the notices", "MIT License", "models/one"):
            self.assertIn(part, text)
        self.assertNotIn("models/two", text)

    def test_each_unit_limits_its_memory(self):
        units = sorted((ROOT / "packaging" / "debian").glob("*.service"))
        self.assertEqual(len(units), 3)
        for unit in units:
            self.assertIn("\nMemoryMax=", unit.read_text(encoding="utf-8"), unit.name)


class OneVersion(unittest.TestCase):
    def test_images_have_the_version_of_the_crate(self):
        manifest = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
        for name in (*OWN, "README.md", "docs/deployment.md"):
            stated = STATED.findall((ROOT / name).read_text(encoding="utf-8"))
            self.assertEqual({*stated}, {manifest["version"]}, name)

    def test_the_image_for_gpus_has_the_onnx_runtime_of_the_other(self):
        text = (ROOT / "docker" / "Dockerfile.cuda").read_text(encoding="utf-8")
        versions = {pinned_runtime("x86_64").version}
        self.assertEqual({*re.findall(r"onnxruntime-gpu==([\d.]+)", text)}, versions)
        self.assertEqual({*re.findall(r"libonnxruntime\.so\.([\d.]+\d)", text)}, versions)


if __name__ == "__main__":
    unittest.main()
