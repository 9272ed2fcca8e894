"""Tests of the networks: `PYTHONPATH=packaging/scripts python -m unittest discover -s networks/tests -t .` in lab/training."""
