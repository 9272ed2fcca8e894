"""The proofs: each module has `prove(effort)`, which returns a row for each result."""
