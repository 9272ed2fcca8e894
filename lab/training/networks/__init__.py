"""The ONNX files of our networks: the source NanoDet-g, weights in half precision, and INT8."""
