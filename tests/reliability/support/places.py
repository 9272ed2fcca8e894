"""Paths."""

from harness.places import ROOT, SAMPLES

__all__ = ["FIXTURES", "OFFICE", "OWN", "ROOT", "SAMPLES", "SCHEMATHESIS", "TINY_MODEL", "WORK"]

OWN = ROOT / ".setup" / "reliability"
"""Created by `packaging/scripts/setup.py reliability`."""
SCHEMATHESIS = OWN / "bin" / "schemathesis"
WORK = OWN / "work"
"""Logs and results of the proofs."""

FIXTURES = ROOT / "tests" / "fixtures"
TINY_MODEL = FIXTURES / "models" / "any_batch.onnx"
"""A network that takes no time, so that the cost of everything else is visible."""
OFFICE = SAMPLES / "office.jpg"
"""A frame of the calibration `office`."""
