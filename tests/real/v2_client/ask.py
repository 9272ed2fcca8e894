"""Sends requests of all kinds with Triton's client, and prints the answers as JSON: `ask.py ADDRESS FRAME`."""

import base64
import json
import sys
from pathlib import Path

import numpy as np
from tritonclient.http import InferenceServerClient, InferInput, InferRequestedOutput
from tritonclient.utils import InferenceServerException

MODEL = "lookdown"
OUTPUTS = ("boxes", "scores", "oriented_boxes", "views", "counts", "report")
FAST = {"calibration": "office", "profile": "fast"}


def main(address: str, frame: bytes) -> dict:
    """The answers of the server."""
    client = InferenceServerClient(address, network_timeout=120.0, concurrency=4)
    return {
        "health": [
            client.is_server_live(),
            client.is_server_ready(),
            client.is_model_ready(MODEL),
            client.is_model_ready("unknown"),
        ],
        "server": client.get_server_metadata(),
        "model": client.get_model_metadata(MODEL),
        "found": {
            f"{'bytes' if sent else 'JSON'} to {'bytes' if answered else 'JSON'}": found(client, frame, sent, answered)
            for sent in (True, False)
            for answered in (True, False)
        }
        | {"gzip": found(client, frame, True, True, request_compression_algorithm="gzip")},
        "batch": {way: batch(client, frame, way) for way in ("gzip", "deflate", None)},
        "asynchronous": asynchronous(client, frame),
        "refused": refused(client, frame),
    }


def image(content: bytes, binary: bool = True) -> InferInput:
    """A frame as an input. As text it is base64."""
    tensor = InferInput("image", [1], "BYTES")
    element = content if binary else base64.b64encode(content)
    return tensor.set_data_from_numpy(np.array([element], dtype=np.object_), binary_data=binary)


def images(*contents: bytes) -> InferInput:
    """Frames as an input."""
    tensor = InferInput("image", [len(contents)], "BYTES")
    return tensor.set_data_from_numpy(np.array(contents, dtype=np.object_))


def batch(client: InferenceServerClient, frame: bytes, compression: str | None) -> dict:
    """The outputs for the same frame three times, in a compressed request."""
    three = images(frame, frame, frame)
    result = client.infer(MODEL, [three], parameters=FAST, request_compression_algorithm=compression)
    return {
        "counts": result.as_numpy("counts").tolist(),
        "scores": result.as_numpy("scores").tolist(),
        "reports": [json.loads(report)["persons"] for report in result.as_numpy("report")],
    }


def found(client: InferenceServerClient, frame: bytes, sent: bool, answered: bool, **options: str) -> dict:
    """The outputs for a frame that is sent and answered as bytes or in JSON."""
    outputs = [InferRequestedOutput(name, binary_data=answered) for name in OUTPUTS]
    asked = {"priority": 3, "timeout": 60_000_000, "parameters": FAST} | options
    result = client.infer(MODEL, [image(frame, sent)], outputs=outputs, request_id="17", **asked)
    arrays = {name: result.as_numpy(name) for name in OUTPUTS}
    report = arrays.pop("report")[0]
    told = {name: array.tolist() for name, array in arrays.items()}
    told["report"] = report.decode() if isinstance(report, bytes) else report
    answer = result.get_response()
    return told | {"model": answer["model_name"], "id": answer["id"]}


def asynchronous(client: InferenceServerClient, frame: bytes) -> list[int]:
    """The number of persons of each of some concurrent requests."""
    waiting = [client.async_infer(MODEL, [image(frame)], parameters=FAST) for _ in range(3)]
    return [len(request.get_result().as_numpy("scores")) for request in waiting]


def refused(client: InferenceServerClient, frame: bytes) -> dict:
    """Status and sentence of requests that are refused."""
    good = [image(frame)]
    shared = InferInput("image", [1], "BYTES").set_shared_memory("region", len(frame))
    requests = {
        "unknown model": ("unknown", good, {}),
        "no image": (MODEL, [image(b"no image")], {}),
        "too many frames": (MODEL, [images(*[b"no image"] * 17)], {}),
        "sequence": (MODEL, good, {"sequence_id": 7, "sequence_start": True}),
        "shared memory": (MODEL, [shared], {}),
        "classes": (MODEL, good, {"outputs": [InferRequestedOutput("scores", class_count=2)]}),
        "unknown output": (MODEL, good, {"outputs": [InferRequestedOutput("masks")]}),
    }
    return {name: refusal(client, *request) for name, request in requests.items()}


def refusal(client: InferenceServerClient, model: str, inputs: list, options: dict) -> list[str]:
    """The refusal of a request."""
    try:
        client.infer(model, inputs, **options)
    except InferenceServerException as error:
        return [error.status(), error.message()]
    return ["200", "it was answered"]


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1], Path(sys.argv[2]).read_bytes())))
