"""An ONNX model for MLServer that takes images as bytes and returns the boxes above a threshold.

The server's REST protocol has JSON only, so the images come in base64: one tensor of bytes `[n, 3, size, size]`.
Settings: MODEL (file), THREADS (of one run of the network), BATCH (images in a run).
"""

import os

import numpy as np
import onnxruntime
from mlserver import MLModel
from mlserver.codecs import Base64Codec, NumpyCodec
from mlserver.types import InferenceRequest, InferenceResponse

SCORE = 0.3


class Detector(MLModel):
    """Detects boxes of persons in images."""

    async def load(self) -> bool:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = int(os.environ["THREADS"])
        self.session = onnxruntime.InferenceSession(os.environ["MODEL"], options, providers=["CPUExecutionProvider"])
        self.size = self.session.get_inputs()[0].shape[2]
        self.batch = int(os.environ["BATCH"])
        return True

    async def predict(self, payload: InferenceRequest) -> InferenceResponse:
        views = np.frombuffer(Base64Codec.decode_input(payload.inputs[0])[0], np.uint8)
        views = views.reshape(-1, 3, self.size, self.size)
        rows = []
        for start in range(0, len(views), self.batch):
            tensor = views[start : start + self.batch].astype(np.float32)
            found = self.session.run(["boxes", "scores"], {"images": tensor})
            for view, (boxes, scores) in enumerate(zip(*found), start):
                good = scores >= SCORE
                rows.append(np.column_stack([np.full(good.sum(), view), boxes[good], scores[good]]))
        answer = NumpyCodec.encode_output("boxes", np.concatenate(rows).astype(np.float32))
        return InferenceResponse(model_name=self.name, outputs=[answer])
