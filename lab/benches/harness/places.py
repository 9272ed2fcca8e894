"""The folders of the benchmarks."""

import os
from pathlib import Path

BENCHES = Path(__file__).resolve().parents[1]
ROOT = BENCHES.parents[1]
RAW = BENCHES / "raw"
RESULTS = BENCHES / "RESULTS.md"
PEERS = BENCHES / "peers"
SAMPLES = ROOT / "samples"
PYTHONS = ROOT / ".setup" / "benches"
"""The Python environments that `packaging/scripts/setup.py benches` makes."""
WORK = PYTHONS / "work"
"""Generated files: frames, plans, logs."""

BINARIES = ROOT / "target" / os.environ.get("PROFILE", "release")
"""The binaries of the profile that the environment names."""
LOOKDOWN = BINARIES / "lookdown"
LOAD = BINARIES / "load"


def model(name: str) -> Path:
    """A model's ONNX file."""
    return ROOT / "models" / name / "model.onnx"


def python_of(peer: str) -> Path:
    """The interpreter of a peer's own environment."""
    return PYTHONS / peer / "bin" / "python"
