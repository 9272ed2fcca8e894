"""Private Python environments, which leave those of the user unchanged."""

import importlib.util
import os
import shutil
import sys
from pathlib import Path

from .commands import run
from .console import SetupError, say
from .pins import Requirement
from .places import Places

# The user's settings for access to registries. Every other PIP_ setting is for the user's own
# environments (PIP_TARGET, PIP_NO_BINARY, PIP_REQUIRE_VIRTUALENV ...) and must not reach this one.
REGISTRY_SETTINGS = {
    *("PIP_INDEX_URL", "PIP_EXTRA_INDEX_URL", "PIP_NO_INDEX", "PIP_FIND_LINKS", "PIP_TRUSTED_HOST", "PIP_CERT"),
    *("PIP_CLIENT_CERT", "PIP_PROXY", "PIP_TIMEOUT", "PIP_DEFAULT_TIMEOUT", "PIP_RETRIES", "PIP_KEYRING_PROVIDER"),
    "PIP_CONFIG_FILE",
}
NO_PIP = (
    "The set-up needs Python's venv module and pip, and this Python lacks one of them; install both "
    "(Debian and Ubuntu: apt-get install python3-venv) and run the set-up again."
)


class PrivatePython:
    """The environment in `.setup/venv` or another folder, created at the first use."""

    def __init__(self, places: Places, step: str, folder: Path | None = None):
        self.places = places
        self.step = step
        self.folder = folder or places.python
        self.python = self.folder / "bin" / "python"

    def pip(self, *arguments: str) -> list[str]:
        """The command that runs pip for this environment; creates the environment if needed."""
        self._make()
        if has_module("ensurepip"):
            return [str(self.python), "-m", "pip", *arguments]
        return [sys.executable, "-m", "pip", "--python", str(self.python), *arguments]

    def install(self, label: str, requirements: tuple[Requirement, ...]) -> None:
        """Installs exactly these packages, by their sums, unless they are installed already."""
        names = ", ".join(dict.fromkeys(pin.package for pin in requirements))
        self._install(label, requirements_text(requirements), names, "--require-hashes")

    def install_file(self, file: Path, *flags: str) -> None:
        """Installs the packages of a requirements file that names every one of them and its version."""
        names = str(file.relative_to(self.places.root))
        self._install(file.parent.name, file.read_text(encoding="utf-8"), names, *flags)

    def _install(self, label: str, wanted: str, names: str, *flags: str) -> None:
        record = self.folder / f"{label}-requirements.txt"
        command = self.pip("install", *flags, "--only-binary=:all:", "--no-deps", "--no-cache-dir")
        if record.is_file() and record.read_text(encoding="utf-8") == wanted:
            return
        say(self.step, f"installing into {self._shown} with pip: {names}")
        with self.places.temporary() as folder:
            listed = folder / record.name
            listed.write_text(wanted, encoding="utf-8")
            run(
                self.step,
                [*command, "-r", str(listed)],
                folder=folder,
                environment=pip_environment(),
                failure="pip could not install what the set-up needs; check the network and pip's index settings, "
                "and run the set-up again. pip said:",
            )
            os.replace(listed, record)

    @property
    def _shown(self) -> Path:
        return self.folder.relative_to(self.places.root)

    def _make(self) -> None:
        flags = [] if has_module("ensurepip") else ["--without-pip"]
        identity = f"{sys.version}\n{os.path.realpath(sys.executable)} {flags}\n"
        record = self.folder / "made-by.txt"
        if record.is_file() and record.read_text(encoding="utf-8") == identity and self.python.exists():
            return
        if not has_module("venv") or not (has_module("ensurepip") or has_module("pip")):
            raise SetupError(NO_PIP)
        say(self.step, f"making a private Python environment in {self._shown}")
        shutil.rmtree(self.folder, ignore_errors=True)
        with self.places.temporary() as folder:
            run(
                self.step,
                [sys.executable, "-m", "venv", *flags, str(self.folder)],
                folder=folder,
                environment=pip_environment(),
                failure=f"{NO_PIP} It said:",
            )
        # Written last: an environment without it is incomplete and is created again.
        record.write_text(identity, encoding="utf-8")


def has_module(name: str) -> bool:
    """Returns True if this Python has the module; Debian omits parts of the standard library."""
    return importlib.util.find_spec(name) is not None


def requirements_text(requirements: tuple[Requirement, ...]) -> str:
    """The pins as a requirements file for `pip install --require-hashes`."""
    lines = []
    for pin in requirements:
        marker = f" ; {pin.marker}" if pin.marker else ""
        hashes = "".join(f" --hash=sha256:{value}" for value in pin.sha256)
        lines.append(f"{pin.package}=={pin.version}{marker}{hashes}\n")
    return "".join(lines)


def pip_environment() -> dict[str, str]:
    """The user's environment without variables that redirect pip or the private Python."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if name in REGISTRY_SETTINGS or not name.startswith(("PIP_", "PYTHON", "VIRTUAL_ENV"))
    }
    # These override the user's configuration file, too.
    quiet = {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INPUT": "1", "PIP_ROOT_USER_ACTION": "ignore"}
    return environment | quiet | {"PIP_REQUIRE_VIRTUALENV": "0", "PIP_USER": "0", "PYTHONNOUSERSITE": "1"}
