"""Fetches ONNX Runtime and the default model: pinned, checked, resumable, all of it inside the repository."""
