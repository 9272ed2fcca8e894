"""Rewrites published detector weights as the ONNX files that Lookdown runs: SSDLite, and the darknet family.

The readers of TensorFlow.js, the translator and the ONNX builder also make our own networks (lab/training/networks).
Needs the packages of packaging/scripts/requirements/converters.txt.
"""


class ConversionError(Exception):
    """An unsupported source; the message has the actual and the required content."""
