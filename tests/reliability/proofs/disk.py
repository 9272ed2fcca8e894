"""A full disk, and a read-only one: writes are refused, everything else works, no file is damaged."""

import contextlib
import json
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from support.effort import Effort
from support.exchange import ask
from support.lookdown import TINY, is_root, lookdown
from support.places import OFFICE, SAMPLES
from support.row import Row

SETTINGS = TINY | {"LOG__FILTER": "error", "CALIBRATIONS__POLL_SECONDS": "1"}
REFUSALS = {403, 503}


def prove(effort: Effort) -> list[Row]:
    """Returns a row for each."""
    del effort
    return [
        _prove(Row("disk full", "a file system of 64 KiB, filled to the last byte"), _fill),
        _prove(Row("read-only disk", "a folder that becomes read-only and writable again"), _make_read_only),
    ]


def _prove(row: Row, spoil) -> Row:
    if not is_root():
        row.skipped = "needs root, for mounts"
        return row
    with _small_disk() as folder:
        shutil.copy(SAMPLES / "calibrations" / "office.json", folder)
        with lookdown(SETTINGS, calibrations=folder) as server:
            _try(row, server.address, folder, spoil)
    return row


def _try(row: Row, address: str, folder: Path, spoil) -> None:
    old = (folder / "office.json").read_bytes()
    changed = json.loads(old)
    changed["lens"]["focal"] += 1.0
    # Longer than the free space in any allocated block.
    new = (json.dumps(changed) + " " * 20000).encode()
    other = json.dumps(changed | {"id": "other"}).encode()
    tag = ask(address, "GET", "/calibrations/office").headers["etag"]
    with spoil(folder):
        refused = ask(address, "PUT", "/calibrations/office", new)
        created = ask(address, "PUT", "/calibrations/other", other)
        served = ask(address, "GET", "/calibrations/office").headers.get("etag")
        detected = ask(address, "POST", "/detect?calibration=office&profile=fast", OFFICE.read_bytes()).status
        ready = ask(address, "GET", "/readyz").status
        row.require(refused.status in REFUSALS, f"a replacement was answered {refused.status}")
        row.require(created.status in REFUSALS, f"a creation was answered {created.status}")
        row.require(
            refused.headers["content-type"] == "application/problem+json",
            f"not a problem document: {refused.body[:200]!r}",
        )
        row.require((folder / "office.json").read_bytes() == old, "the file has changed")
        row.require(served == tag, "another revision is served")
        row.require((detected, ready) == (200, 200), f"/detect answered {detected}, /readyz {ready}")
        row.require(
            sorted(file.name for file in folder.iterdir() if file.suffix != ".fill") == ["office.json"], "files left"
        )
    accepted = ask(address, "PUT", "/calibrations/office", new).status
    row.require(accepted == 200, f"a write afterwards was answered {accepted}")
    kind = refused.json().get("type", "").rpartition(":")[2]
    row.seen = f"writes answered {refused.status} `{kind}`, frames 200, the old file kept; writes work again afterwards"


@contextlib.contextmanager
def _small_disk() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _run("mount", "-t", "tmpfs", "-o", "size=64k", "lookdown-proof", name)
        try:
            yield folder
        finally:
            _run("umount", name)


@contextlib.contextmanager
def _fill(folder: Path) -> Iterator[None]:
    filler = folder / "all.fill"
    with contextlib.suppress(OSError), open(filler, "wb", buffering=0) as file:
        while True:
            file.write(bytes(512))
    yield
    filler.unlink()


@contextlib.contextmanager
def _make_read_only(folder: Path) -> Iterator[None]:
    _run("mount", "-o", "remount,ro", str(folder))
    yield
    _run("mount", "-o", "remount,rw,size=64k", str(folder))


def _run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True)
