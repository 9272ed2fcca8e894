"""Tests of the networks: `PYTHONPATH=scripts python -m unittest discover -s networks/tests -t .` in lab/training."""
