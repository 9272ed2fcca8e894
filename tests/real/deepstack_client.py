"""Sends requests with real clients of DeepStack: `deepstack_client.py CLIENT PORT IMAGE MODEL KEY MIN_CONFIDENCE`.

`CLIENT` is `python` (deepstack-python, which Home Assistant's integration uses), `sdk` (deepstack-sdk) or `codeproject`
(codeproject-ai-api). An empty model or key means none. Prints the client's result, or its exception, as JSON.
"""

import json
import sys
from pathlib import Path


def with_python(port: str, image: Path, model: str, key: str, confidence: float) -> list[dict]:
    from deepstack.core import DeepstackObject

    server = DeepstackObject("127.0.0.1", int(port), key, min_confidence=confidence, custom_model=model)
    return server.detect(image.read_bytes())


def with_sdk(port: str, image: Path, model: str, key: str, confidence: float) -> list[dict]:
    from deepstack_sdk import Detection, ServerConfig

    server = Detection(ServerConfig(f"http://127.0.0.1:{port}", api_key=key or None), name=model or None)
    return [vars(item) for item in server.detectObject(str(image), min_confidence=confidence)]


def with_codeproject(port: str, image: Path, model: str, _key: str, confidence: float) -> list[dict]:
    from codeprojectai.core import CodeProjectAIObject

    server = CodeProjectAIObject("127.0.0.1", int(port), min_confidence=confidence, custom_model=model)
    return server.detect(image.read_bytes())


def main(client: str, port: str, image: str, model: str, key: str, confidence: str) -> None:
    detect = {"python": with_python, "sdk": with_sdk, "codeproject": with_codeproject}[client]
    try:
        answer = {"predictions": detect(port, Path(image), model, key, float(confidence))}
    except Exception as error:  # The test checks any exception of a client.
        answer = {"raised": f"{type(error).__name__}: {error}"}
    print(json.dumps(answer))


if __name__ == "__main__":
    main(*sys.argv[1:])
