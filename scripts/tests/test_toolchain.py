"""Missing build programs are reported before any download, with the remedy; the workflows pin the compiler."""

import re
import tomllib
import unittest
from unittest import mock

from assets.console import SetupError
from assets.toolchain import check_toolchain
from dist import ROOT

from .support import InEmptyFolder


class Toolchain(InEmptyFolder):
    def setUp(self):
        super().setUp()
        self.write("Cargo.toml", b'[workspace.package]\nrust-version = "1.92"\n')
        self.enterContext(mock.patch.dict("os.environ", {"PATH": str(self.folder / "bin")}, clear=True))

    def check_with(self, *programs: str, rust: str = "rustc 1.95.0 (abc 2026-01-01)"):
        for program in programs:
            file = self.write(f"bin/{program}", f"#!/bin/sh\necho '{rust}'\n".encode())
            file.chmod(0o755)
        check_toolchain(self.folder)

    def test_a_complete_toolchain_passes(self):
        self.check_with("cargo", "rustc", "cc")
        self.assertIn("Rust 1.95", self.printed.getvalue())

    def test_missing_cargo_is_named_with_the_version_to_install(self):
        with self.assertRaisesRegex(SetupError, "needs cargo, .*; install Rust 1.92 or newer"):
            self.check_with("rustc", "cc")

    def test_an_older_rust_is_refused_with_its_version(self):
        with self.assertRaisesRegex(SetupError, "needs Rust 1.92 and this is 1.63"):
            self.check_with("cargo", "rustc", "cc", rust="rustc 1.63.0")

    def test_a_rustc_that_does_not_run_is_quoted(self):
        with self.assertRaisesRegex(SetupError, "does not work: no toolchain"):
            self.check_with("cargo", "rustc", "cc", rust="no toolchain")

    def test_a_missing_linker_is_named_with_the_remedy(self):
        with self.assertRaisesRegex(SetupError, "apt-get install gcc"):
            self.check_with("cargo", "rustc")

    def test_a_linker_of_the_users_own_is_enough(self):
        with mock.patch.dict("os.environ", CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_LINKER="clang"):
            self.check_with("cargo", "rustc")


class Workflows(unittest.TestCase):
    def test_the_workflows_name_one_compiler_that_is_new_enough(self):
        found = set()
        for workflow in (ROOT / ".github" / "workflows").glob("*.yml"):
            pinned = re.findall(r"RUSTUP_TOOLCHAIN: \"([\d.]+)\"", workflow.read_text(encoding="utf-8"))
            self.assertEqual(len(pinned), 1, workflow.name)
            found.update(pinned)
        self.assertEqual(len(found), 1, found)
        oldest = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"][
            "rust-version"
        ]
        version = [int(part) for part in found.pop().split(".")]
        self.assertGreaterEqual(version, [int(part) for part in oldest.split(".")])
