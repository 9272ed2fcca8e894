"""Unsupported machines are refused with the supported ones and their own kind."""

import unittest
from unittest import mock

from assets.console import SetupError
from assets.machine import supported_cpu


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

    def test_another_operating_system_is_named(self):
        with self.assertRaisesRegex(SetupError, "supports Linux on x86-64 and arm64; this is Darwin on arm64"):
            self.on(system="darwin", cpu="arm64")

    def test_another_processor_is_named(self):
        with self.assertRaisesRegex(SetupError, "supports Linux on x86-64 and arm64; this is Linux on riscv64"):
            self.on(cpu="riscv64")

    def test_a_32_bit_system_on_a_64_bit_processor_is_refused(self):
        with self.assertRaisesRegex(SetupError, "this is Linux on aarch64 with a 32-bit Python"):
            self.on(cpu="aarch64", largest=2**31 - 1)

    def test_musl_is_refused(self):
        with self.assertRaisesRegex(SetupError, "needs a Linux with the GNU C library"):
            self.on(libc=None)

    def test_old_glibc_is_refused_with_its_version(self):
        self.assertEqual(self.on(libc="glibc 2.28"), "x86_64")
        with self.assertRaisesRegex(SetupError, "needs glibc 2.28 or newer and this system has 2.27"):
            self.on(libc="glibc 2.27")
