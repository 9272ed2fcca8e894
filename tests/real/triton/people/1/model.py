"""An ONNX model for Triton's Python backend that returns its outputs unchanged: MODEL is its file."""

import os

import numpy
import onnxruntime
import triton_python_backend_utils as backend


class TritonPythonModel:
    """The network without pre- or post-processing."""

    def initialize(self, _arguments):
        """Loads the model."""
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(os.environ["MODEL"], options, providers=["CPUExecutionProvider"])
        self.names = [output.name for output in self.session.get_outputs()]

    def execute(self, requests):
        """Runs the requests that Triton has collected as one batch."""
        views = [backend.get_input_tensor_by_name(request, "images").as_numpy() for request in requests]
        ends = numpy.cumsum([len(each) for each in views])[:-1]
        outputs = [
            numpy.split(whole, ends) for whole in self.session.run(self.names, {"images": numpy.concatenate(views)})
        ]
        return [
            backend.InferenceResponse([backend.Tensor(name, part) for name, part in zip(self.names, parts)])
            for parts in zip(*outputs)
        ]
