"""Python environments of checkers, tests and benchmarks, in folders of `.setup`. No build needs one."""

import importlib.util
import os
import shutil
import sys
from pathlib import Path

from .console import SetupError, run, say

# The requirements of each step, and the environment that gets them. Steps may share an environment.
STEPS = {
    "checkers": (("packaging/scripts/requirements/checkers.txt", "venv"),),
    "converters": (("packaging/scripts/requirements/converters.txt", "venv"),),
    "reliability": (("tests/reliability/requirements.txt", "reliability"),),
    "wheel": (("crates/lookdown-python/build-requirements.txt", "wheel"),),
}
# Folders of requirements with an environment for each file.
FAMILIES = {
    "real-parts": ("tests/real/requirements/*.txt", lambda file: f"real/{file.stem}"),
    "benches": ("lab/benches/**/requirements.txt", lambda file: f"benches/{file.parent.name}"),
}
NO_VENV = (
    "The set-up needs Python's venv module with pip; install it (Debian and Ubuntu: apt-get install python3-venv) and "
    "run the set-up again."
)


def install_step(root: Path, step: str) -> None:
    """Installs the environments of a step."""
    pattern, place = FAMILIES.get(step, ("", None))
    rows = [(file, place(file)) for file in sorted(root.glob(pattern))] if place else STEPS[step]
    for file, name in rows:
        install(root, step, root / file, root / ".setup" / name)


def install(root: Path, step: str, file: Path, folder: Path) -> None:
    """Installs exactly the packages of a requirements file, unless they are installed already."""
    wanted = file.read_text(encoding="utf-8")
    record = folder / f"{file.parent.name}-{file.name}"
    _make(folder)
    if record.is_file() and record.read_text(encoding="utf-8") == wanted:
        return
    say(step, f"installing {file.relative_to(root)} into {folder.relative_to(root)} with pip")
    hashes = ["--require-hashes"] if "--hash" in wanted else []
    flags = ["--only-binary=:all:", "--no-deps", "--no-cache-dir"]
    run(
        [folder / "bin" / "python", "-m", "pip", "install", *hashes, *flags, "-r", file],
        folder,
        f"pip could not install {file.relative_to(root)}; check the network and pip's index settings, and run the "
        "set-up again. pip said:",
    )
    record.write_text(wanted, encoding="utf-8")


def _make(folder: Path) -> None:
    identity = f"{sys.version}\n{os.path.realpath(sys.executable)}\n"
    record = folder / "made-by.txt"
    if record.is_file() and record.read_text(encoding="utf-8") == identity:
        return
    if not importlib.util.find_spec("ensurepip"):
        raise SetupError(NO_VENV)
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    run([sys.executable, "-m", "venv", folder], folder.parent, f"{NO_VENV} It said:")
    # Written last: an environment without it is incomplete and is created again.
    record.write_text(identity, encoding="utf-8")
