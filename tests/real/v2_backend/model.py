"""An ONNX model for MLServer that takes views as numbers and returns its outputs unchanged: MODEL is its file."""

import os

import onnxruntime
from mlserver import MLModel
from mlserver.codecs import NumpyCodec
from mlserver.types import InferenceRequest, InferenceResponse


class Network(MLModel):
    """The network without pre- or post-processing."""

    async def load(self) -> bool:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(os.environ["MODEL"], options, providers=["CPUExecutionProvider"])
        self.names = [output.name for output in self.session.get_outputs()]
        return True

    async def predict(self, payload: InferenceRequest) -> InferenceResponse:
        (views,) = payload.inputs
        outputs = self.session.run(self.names, {views.name: NumpyCodec.decode_input(views)})
        answered = [NumpyCodec.encode_output(name, values) for name, values in zip(self.names, outputs)]
        return InferenceResponse(model_name=self.name, outputs=answered)
