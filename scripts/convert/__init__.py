"""Rewrites published detector weights as the ONNX files that Lookdown runs.

One file per model says how that model's graph is cut, fed and decoded; the readers, the translator and the
ONNX builder are shared. Users convert weights of their own with `darknet` and `yolox`. Needs the packages listed
in `pins.toml` under `converter`; `setup.py` provides them.
"""
