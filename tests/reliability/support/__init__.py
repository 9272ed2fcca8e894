"""Shared code of the proofs."""
