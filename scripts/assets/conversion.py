"""Runs a converter that a user calls by hand in the private Python environment, which has what converters import."""

import argparse
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from convert.errors import ConversionError

from .console import SetupError
from .pins import read_pins
from .places import Places
from .private_python import PrivatePython, pip_environment

ROOT = Path(__file__).resolve().parents[2]
HOW_TO_RUN = (
    "Any Python from 3.11 on can run this: it creates the private environment .setup/venv if needed, and continues "
    "in it. OUT_FOLDER is then a model like those under models/; LOOKDOWN__MODEL__PATH=OUT_FOLDER selects it. "
)


def command_line(description: str, sources: dict[str, str], note: str) -> argparse.ArgumentParser:
    """The common arguments of the converters, after the input files with their names and descriptions."""
    made = argparse.ArgumentParser(description=description, epilog=HOW_TO_RUN + note)
    for name, meaning in sources.items():
        made.add_argument(name, type=Path, metavar=name.upper(), help=meaning)
    made.add_argument("folder", type=Path, metavar="OUT_FOLDER", help="the folder for model.onnx and model.toml")
    made.add_argument("--name", help="the model's name in reports; the folder's name by default")
    made.add_argument(
        "--class-names",
        type=Path,
        metavar="FILE",
        help="the classes' names, one a line, one of them 'person'; not needed for 80 classes (COCO) and 20 (VOC)",
    )
    return made


def main(script: str, convert: Callable[[], str]) -> int:
    """Calls `convert` and prints its result; runs the script again in the private Python if needed."""
    places = Places(ROOT)
    try:
        if Path(sys.prefix).resolve() != places.python.resolve():
            return _run_again(places, script)
        print(convert())
    except (ConversionError, SetupError) as error:
        print(f"The conversion stopped. {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"The conversion stopped. {error.strerror or error}: {error.filename}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def _run_again(places: Places, script: str) -> int:
    pins = read_pins(places.root / "scripts" / "pins.toml")
    python = PrivatePython(places, "python")
    with places.locked():
        python.install("converter", pins.converter)
    command = [str(python.python), os.path.abspath(script), *sys.argv[1:]]
    environment = pip_environment() | {"PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(command, env=environment, check=False).returncode
