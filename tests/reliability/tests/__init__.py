"""Tests of the shared code of the proofs."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[3] / "lab/benches"))
