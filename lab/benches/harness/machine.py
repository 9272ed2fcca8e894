"""The machine of the measurements."""

import datetime
import os
import platform
import subprocess
import tomllib

from .places import ROOT


def made() -> dict:
    """Machine, versions, commit and time."""
    pins = tomllib.loads((ROOT / "packaging" / "scripts" / "pins.toml").read_text(encoding="utf-8"))
    changed = bool(
        _said("git", "status", "--porcelain", "--untracked-files=no", "--", "src", "crates", "Cargo.lock", "models")
    )
    return {
        "cpu": _lscpu("Model name"),
        "cores": len(os.sched_getaffinity(0)),
        "onnx_runtime": pins["runtime"]["version"],
        "commit": _said("git", "rev-parse", "--short", "HEAD") + (", changed" if changed else ""),
        "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "load_before": os.getloadavg()[0],
    }


def _lscpu(field: str) -> str:
    for line in _said("lscpu").splitlines():
        name, _, value = line.partition(":")
        if name.strip() == field:
            return value.strip()
    return platform.machine()


def _said(*command: str) -> str:
    try:
        answer = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, check=False, env=os.environ | {"LC_ALL": "C"}
        )
    except OSError:
        return ""
    return answer.stdout.strip()
