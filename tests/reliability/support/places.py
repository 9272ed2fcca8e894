"""Where things are."""

from harness.places import ROOT, SAMPLES

__all__ = ["FIXTURES", "OFFICE", "OWN", "ROOT", "SAMPLES", "SCHEMATHESIS", "TINY_MODEL", "WORK"]

OWN = ROOT / ".setup" / "reliability"
"""What `scripts/setup.py reliability` makes."""
SCHEMATHESIS = OWN / "bin" / "schemathesis"
WORK = OWN / "work"
"""Logs and results of the proofs."""

FIXTURES = ROOT / "tests" / "fixtures"
TINY_MODEL = FIXTURES / "models" / "any_batch.onnx"
"""A network that takes no time, so that everything around it shows."""
OFFICE = SAMPLES / "office.jpg"
"""A frame of the calibration `office`."""
