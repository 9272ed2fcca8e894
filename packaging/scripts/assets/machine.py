"""The supported machines: Linux with glibc, on x86-64 or arm64. And the programs that build Lookdown, before any download."""

import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from .console import SetupError, say

CPU_NAMES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
OLDEST_GLIBC = (2, 28)
VERSION = re.compile(r"rustc (\d+)\.(\d+)")


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


def check_toolchain(root: Path) -> None:
    """Checks for cargo, a recent Rust, and the C compiler, which compiles C code of crates and links."""
    wanted = tomllib.loads((root / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]["rust-version"]
    advice = f"install Rust {wanted} or newer, with rustup or from your distribution, and run the set-up again"
    for program in ("cargo", "rustc"):
        if shutil.which(program) is None:
            raise SetupError(f"Building Lookdown needs {program}, which is not in PATH; {advice}.")
    found = _rust_version(root)
    if found < tuple(int(part) for part in wanted.split(".")[:2]):
        raise SetupError(f"Lookdown needs Rust {wanted} and this is {found[0]}.{found[1]}; {advice}.")
    if shutil.which("cc") is None and not _names_its_own_linker():
        raise SetupError(
            "Rust links programs with the C compiler `cc`, which is not in PATH; install one "
            "(Debian and Ubuntu: apt-get install gcc libc6-dev) and run the set-up again."
        )
    say("toolchain", f"Rust {found[0]}.{found[1]} and a linker are here")


def _rust_version(root: Path) -> tuple[int, int]:
    answer = subprocess.run(["rustc", "--version"], cwd=root, capture_output=True, text=True, check=False)
    version = VERSION.match(answer.stdout)
    if version is None:
        raise SetupError(f"`rustc --version` does not work: {answer.stderr.strip() or answer.stdout.strip()}")
    return int(version[1]), int(version[2])


def _names_its_own_linker() -> bool:
    return any(name.startswith("CARGO_TARGET_") and name.endswith("_LINKER") for name in os.environ)
