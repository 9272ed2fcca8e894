"""The set-up: what stops it, machines that are not supported, and missing build programs.

The workflows pin the compiler.
"""

import contextlib
import io
import re
import tomllib
import unittest
from pathlib import Path
from unittest import mock

import setup
from assets import main
from assets.console import SetupError
from assets.machine import check_toolchain, supported_cpu
from dist import ROOT

from .support import InEmptyFolder


class OldPython(unittest.TestCase):
    def test_old_python_is_refused_with_version_and_remedy(self):
        self.assertIsNone(setup.refusal_of((3, 11, 0)))
        self.assertIn("3.11 or newer and this is Python 3.9", setup.refusal_of((3, 9, 2)))
        self.assertIn("make setup PYTHON=", setup.refusal_of((2, 7, 18)))

    def test_the_entry_is_readable_to_old_interpreters(self):
        source = Path(setup.__file__).read_text(encoding="utf-8")
        for too_new in ('f"', "->", ":="):
            self.assertNotIn(too_new, source)


class Stopping(unittest.TestCase):
    def stopped_by(self, cause: BaseException) -> tuple[int, str]:
        errors = io.StringIO()
        with mock.patch.object(main, "_set_up", side_effect=cause), contextlib.redirect_stderr(errors):
            return main.main([]), errors.getvalue()

    def test_what_the_user_can_put_right_is_said_without_a_traceback(self):
        self.assertEqual(self.stopped_by(SetupError("Install this.")), (1, "\nThe set-up stopped. Install this.\n"))

    def test_a_full_disk_and_a_foreign_folder_are_explained(self):
        for number, part in ((28, "no space left for /x"), (13, "/x cannot be written by this user")):
            status, text = self.stopped_by(OSError(number, "", "/x"))
            self.assertEqual(status, 1)
            self.assertIn(part, text)

    def test_an_interruption_says_that_nothing_is_lost(self):
        status, text = self.stopped_by(KeyboardInterrupt())
        self.assertEqual(status, 130)
        self.assertIn("What was finished is kept", text)

    def test_an_unknown_step_is_refused_with_the_known_ones(self):
        errors = io.StringIO()
        with contextlib.redirect_stderr(errors):
            self.assertEqual(main.main(["everything"]), 2)
        self.assertIn("toolchain, runtime, models", errors.getvalue())


def machine(system="linux", cpu="x86_64", libc="glibc 2.36", largest=2**63 - 1):
    """Pretends to be another machine; `libc=None` is a C library without glibc's version query."""
    answer = {"side_effect": ValueError("unrecognized name")} if libc is None else {"return_value": libc}
    patches = mock.patch.multiple("sys", platform=system, maxsize=largest)
    patched_cpu = mock.patch("platform.machine", return_value=cpu)
    patched_system = mock.patch("platform.system", return_value=system.capitalize())
    return patches, patched_cpu, patched_system, mock.patch("os.confstr", **answer)


class Machine(unittest.TestCase):
    def on(self, **kind) -> str:
        for patch in machine(**kind):
            self.enterContext(patch)
        return supported_cpu()

    def test_both_spellings_of_both_processors_are_supported(self):
        for spelled, cpu in (("x86_64", "x86_64"), ("AMD64", "x86_64"), ("aarch64", "aarch64"), ("arm64", "aarch64")):
            self.assertEqual(self.on(cpu=spelled), cpu)

    def test_an_unsupported_machine_is_named(self):
        for kind, told in (
            ({"system": "darwin", "cpu": "arm64"}, "supports Linux on x86-64 and arm64; this is Darwin on arm64"),
            ({"cpu": "riscv64"}, "supports Linux on x86-64 and arm64; this is Linux on riscv64"),
            ({"cpu": "aarch64", "largest": 2**31 - 1}, "this is Linux on aarch64 with a 32-bit Python"),
            ({"libc": None}, "needs a Linux with the GNU C library"),
        ):
            with self.subTest(told), self.assertRaisesRegex(SetupError, told):
                self.on(**kind)

    def test_old_glibc_is_refused_with_its_version(self):
        self.assertEqual(self.on(libc="glibc 2.28"), "x86_64")
        with self.assertRaisesRegex(SetupError, "needs glibc 2.28 or newer and this system has 2.27"):
            self.on(libc="glibc 2.27")


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
