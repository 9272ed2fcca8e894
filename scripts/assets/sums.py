"""sha256 sums of files."""

import hashlib
from pathlib import Path

from .console import SetupError


def sha256_of(file: Path) -> str:
    """The sum of a file, in hexadecimal."""
    with open(file, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def is_whole(file: Path, sha256: str) -> bool:
    """Returns True if the file exists with this content."""
    return file.is_file() and sha256_of(file) == sha256


FETCHED_REMEDY = "Run the set-up again; if it fails again, ask the operator of your package mirror or proxy."


def require_sum(file: Path, sha256: str, origin: str, remedy: str = FETCHED_REMEDY) -> None:
    """Refuses a file with a sum other than the pinned one; `origin` is its source."""
    found = sha256_of(file)
    if found != sha256:
        raise SetupError(
            f"{file.name} from {origin} is not the file that Lookdown pins: its sha256 is {found}, pinned is {sha256}. "
            f"It was deleted. {remedy}"
        )
