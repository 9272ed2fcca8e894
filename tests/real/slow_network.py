"""An inference server of the Open Inference Protocol that waits before each answer: `slow_network.py PORT MODEL SECONDS`.

The network is a real one, in ONNX Runtime with a thread for each request. Tensors are bytes (`binary_tensor_data`).
"""

import http.server
import json
import sys
import time

import numpy as np
import onnxruntime

HEAD_LENGTH = "Inference-Header-Content-Length"


def served(file: str, seconds: float) -> type[http.server.BaseHTTPRequestHandler]:
    """The handler of a model."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(file, options, providers=["CPUExecutionProvider"])
    (source,) = session.get_inputs()
    targets = session.get_outputs()

    def described(tensor: onnxruntime.NodeArg) -> dict:
        shape = [size if isinstance(size, int) else -1 for size in tensor.shape]
        return {"name": tensor.name, "datatype": "FP32", "shape": shape}

    class Handler(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_):
            """Logs nothing."""

        def do_GET(self):
            """Answers health checks and descriptions."""
            if self.path.endswith("ready") or self.path.endswith("live"):
                self._send(b"")
            elif self.path == "/v2":
                self._send(b'{"name": "slow", "version": "1", "extensions": ["binary_tensor_data"]}')
            else:
                name = self.path.rsplit("/", 1)[1]
                model = {"name": name, "versions": [], "platform": "onnx", "inputs": [described(source)]}
                self._send(json.dumps(model | {"outputs": [described(target) for target in targets]}).encode())

        def do_POST(self):
            """Answers an inference request."""
            body = self.rfile.read(int(self.headers["Content-Length"]))
            length = int(self.headers[HEAD_LENGTH])
            (views,) = json.loads(body[:length])["inputs"]
            values = np.frombuffer(body[length:], np.float32).reshape(views["shape"])
            found = session.run(None, {source.name: values})
            time.sleep(seconds)
            outputs = [
                described(target) | {"shape": list(array.shape), "parameters": {"binary_data_size": array.nbytes}}
                for target, array in zip(targets, found, strict=True)
            ]
            head = json.dumps({"model_name": "slow", "outputs": outputs}).encode()
            tensors = b"".join(array.astype(np.float32).tobytes() for array in found)
            self._send(head + tensors, len(head))

        def _send(self, body: bytes, head_length: int | None = None) -> None:
            self.send_response(200)
            if head_length is not None:
                self.send_header(HEAD_LENGTH, str(head_length))
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

    return Handler


if __name__ == "__main__":
    port, file, seconds = sys.argv[1:]
    http.server.ThreadingHTTPServer(("127.0.0.1", int(port)), served(file, float(seconds))).serve_forever()
