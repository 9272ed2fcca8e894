"""The set-up: ONNX Runtime, pinned and checked, and environments for checks and tests, inside the repository."""
