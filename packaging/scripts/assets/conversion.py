"""Runs a converter that a user calls by hand in the environment of the converters."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from convert import ConversionError

from .console import SetupError, environment
from .environments import install_step
from .main import ROOT, locked

HOW_TO_RUN = "Any Python from 3.11 on can run this: it creates the private environment .setup/venv if needed, and continues in it. "


def main(script: str, convert: Callable[[], str]) -> int:
    """Calls `convert` and prints its result; runs the script again in the environment if needed."""
    own = ROOT / ".setup" / "venv"
    try:
        if Path(sys.prefix).resolve() == own.resolve():
            print(convert())
            return 0
        with locked(ROOT / ".setup"):
            install_step(ROOT, "converters")
    except (ConversionError, SetupError) as error:
        print(f"The conversion stopped. {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"The conversion stopped. {error.strerror or error}: {error.filename}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    command = [own / "bin" / "python", os.path.abspath(script), *sys.argv[1:]]
    return subprocess.run(command, env=environment() | {"PYTHONDONTWRITEBYTECODE": "1"}, check=False).returncode
