"""Messages, errors and programs of the set-up."""

import os
import subprocess
from pathlib import Path

LAST_LINES = 8
REGISTRY_SETTINGS = {
    *("PIP_INDEX_URL", "PIP_EXTRA_INDEX_URL", "PIP_NO_INDEX", "PIP_FIND_LINKS", "PIP_TRUSTED_HOST", "PIP_CERT"),
    *("PIP_CLIENT_CERT", "PIP_PROXY", "PIP_TIMEOUT", "PIP_DEFAULT_TIMEOUT", "PIP_RETRIES", "PIP_KEYRING_PROVIDER"),
    "PIP_CONFIG_FILE",
}


class SetupError(Exception):
    """An error that stops the set-up; the message has the reason and the remedy."""


def say(step: str, text: str) -> None:
    """Prints one line of a step."""
    print(f"{step:<10} {text}", flush=True)


def run(command: list, folder: Path, failure: str) -> None:
    """Runs a command; when it fails, `failure` and the end of its output become the error."""
    ran = subprocess.run(
        command, cwd=folder, env=environment(), stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )
    if ran.returncode != 0:
        lines = (ran.stdout + ran.stderr).strip().splitlines()[-LAST_LINES:]
        raise SetupError("\n".join([failure, *(f"  {line}" for line in lines)]))


def environment() -> dict[str, str]:
    """The user's environment without variables that redirect pip or Python."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if name in REGISTRY_SETTINGS or not name.startswith(("PIP_", "PYTHON", "VIRTUAL_ENV"))
    }
    # These override the user's configuration file, too.
    quiet = {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INPUT": "1", "PIP_ROOT_USER_ACTION": "ignore"}
    return kept | quiet | {"PIP_REQUIRE_VIRTUALENV": "0", "PIP_USER": "0", "PYTHONNOUSERSITE": "1"}
