"""The supported machines: Linux with glibc, on x86-64 or arm64."""

import os
import platform
import sys

from .console import SetupError

CPU_NAMES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
OLDEST_GLIBC = (2, 28)


def supported_cpu() -> str:
    """`x86_64` or `aarch64`; raises an error with the kind of this machine otherwise."""
    cpu = CPU_NAMES.get(platform.machine().lower())
    if sys.platform != "linux" or cpu is None or sys.maxsize < 2**32:
        bits = 64 if sys.maxsize >= 2**32 else 32
        raise SetupError(
            "Lookdown's set-up supports Linux on x86-64 and arm64; "
            f"this is {platform.system()} on {platform.machine()} with a {bits}-bit Python."
        )
    _require_glibc()
    return cpu


def _require_glibc() -> None:
    try:
        name, _, version = (os.confstr("CS_GNU_LIBC_VERSION") or "").partition(" ")
    except ValueError:
        name, version = "", ""
    if name != "glibc":
        raise SetupError(
            "Lookdown's set-up needs a Linux with the GNU C library (glibc), which ONNX Runtime is built for; "
            "this one has another, as Alpine does. Use Debian 10, Ubuntu 20.04, RHEL 8 or newer."
        )
    if tuple(int(part) for part in version.split(".")[:2]) < OLDEST_GLIBC:
        raise SetupError(
            f"ONNX Runtime needs glibc 2.28 or newer and this system has {version}; "
            "use Debian 10, Ubuntu 20.04, RHEL 8 or newer."
        )
