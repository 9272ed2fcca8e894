"""Checks for the programs that build Lookdown, before any download."""

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

from .console import SetupError, say

VERSION = re.compile(r"rustc (\d+)\.(\d+)")


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
