"""Fetches ONNX Runtime and the models: pinned, checked, resumable, all of it inside the repository."""
