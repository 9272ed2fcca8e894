"""Downloads ONNX Runtime and the models: pinned, checked, resumable, inside the repository."""
