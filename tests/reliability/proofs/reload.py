"""Files are damaged while the server runs: the last valid calibration and the last valid model stay in use."""

import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from support.effort import Effort
from support.exchange import ask
from support.lookdown import DETECT, lookdown
from support.places import OFFICE, SAMPLES, TINY_MODEL
from support.row import Row

MANIFEST = 'name = "tiny"\nonnx = "model.onnx"\n'
PATIENCE_SECONDS = 8.0
"""Much longer than the polling interval."""


def prove(effort: Effort) -> list[Row]:
    """Returns a row for each kind of file."""
    del effort
    with tempfile.TemporaryDirectory() as name:
        calibrations, model = Path(name) / "calibrations", Path(name) / "tiny"
        shutil.copytree(SAMPLES / "calibrations", calibrations)
        model.mkdir()
        shutil.copy(TINY_MODEL, model / "model.onnx")
        (model / "model.toml").write_text(MANIFEST, encoding="utf-8")
        settings = {
            "MODEL__PATH": str(model),
            "MODEL__POLL_SECONDS": "1",
            "CALIBRATIONS__POLL_SECONDS": "1",
            "LOG__FILTER": "off",
        }
        with lookdown(settings, calibrations=calibrations) as server:
            return [_calibration(server.address, calibrations / "office.json"), _model(server.address, model)]


def damages(whole: bytes) -> dict[str, bytes]:
    """Damaged contents of a file."""
    return {
        "empty": b"",
        "cut off": whole[: len(whole) // 2],
        "noise": bytes(range(256)) * 8,
        "one byte changed": whole[:1] + bytes([whole[1] ^ 0x20]) + whole[2:],
        "text": b"not what you expect",
    }


def _calibration(address: str, file: Path) -> Row:
    whole = file.read_bytes()
    row = Row("calibration damaged while serving", f"{len(damages(whole))} kinds of damage, and a good file after each")
    revision = _revision(address)
    for kind, damage in damages(whole).items():
        if kind == "one byte changed":
            continue  # white space
        file.write_bytes(damage)
        row.require(_becomes(lambda: _is_reported_invalid(address)), f"{kind}: /readyz does not report it")
        row.require(_revision(address) == revision, f"{kind}: another calibration is served")
        row.require(_detects(address), f"{kind}: frames are refused")
        file.write_bytes(whole)
        row.require(_becomes(lambda: not _is_reported_invalid(address)), f"{kind}: the valid file is not loaded")
    row.done = row.done.replace(str(len(damages(whole))), str(len(damages(whole)) - 1))
    row.seen = "the old revision was served throughout, /readyz reported each damage, the valid file was loaded again"
    return row


def _model(address: str, folder: Path) -> Row:
    onnx, manifest = folder / "model.onnx", folder / "model.toml"
    whole = onnx.read_bytes()
    row = Row(
        "model damaged while serving", f"{len(damages(whole))} kinds of damage, and of its manifest, and a good one"
    )
    revision = _model_revision(address)
    for file, good in ((onnx, whole), (manifest, manifest.read_bytes())):
        for kind, damage in damages(good).items():
            failures = _failed_loads(address)
            file.write_bytes(damage)
            row.require(
                _becomes(lambda before=failures: _failed_loads(address) > before), f"{file.name} {kind}: not noticed"
            )
            row.require(_model_revision(address) == revision, f"{file.name} {kind}: another model answers")
            file.write_bytes(good)
    manifest.write_text(MANIFEST + "[input]\nscale = [0.5, 0.5, 0.5]\n", encoding="utf-8")
    row.require(_becomes(lambda: _model_revision(address) != revision), "a new valid model is not loaded")
    row.seen = "the old revision answered throughout, each damage was counted, a new valid model was loaded"
    return row


def _becomes(holds: Callable[[], bool]) -> bool:
    """Returns true if the condition becomes true in time."""
    deadline = time.monotonic() + PATIENCE_SECONDS
    while time.monotonic() < deadline:
        if holds():
            return True
        time.sleep(0.1)
    return False


def _revision(address: str) -> str | None:
    return ask(address, "GET", "/calibrations/office").headers.get("etag")


def _is_reported_invalid(address: str) -> bool:
    return bool(ask(address, "GET", "/readyz").json()["calibrations"]["problems"])


def _detects(address: str) -> bool:
    return ask(address, "POST", DETECT, OFFICE.read_bytes()).status == 200


def _model_revision(address: str) -> str:
    return ask(address, "POST", DETECT, OFFICE.read_bytes()).json()["model"]["revision"]


def _failed_loads(address: str) -> float:
    lines = ask(address, "GET", "/metrics").body.decode().splitlines()
    counted = [line for line in lines if line.startswith("lookdown_model_loads_total") and "failure" in line]
    return float(counted[0].split()[-1]) if counted else 0.0
