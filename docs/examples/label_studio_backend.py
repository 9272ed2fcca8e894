"""Machine learning backend for Label Studio: predicts persons with a Lookdown server.

Label Studio calls `/setup`, `/health` and `/predict`. An image is read from Label Studio only, with its access
token, and sent to Lookdown, which answers with a Label Studio task.
"""

import argparse
import json
import os
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlencode, urljoin
from urllib.request import HTTPRedirectHandler, Request, build_opener, urlopen

TIMEOUT_SECONDS = 60
MAX_IMAGE_BYTES = 32 * 1024 * 1024
MAX_REQUEST_BYTES = 16 * 1024 * 1024


class NoRedirects(HTTPRedirectHandler):
    """Refuses redirects, which would send the token elsewhere."""

    def redirect_request(self, *_: object) -> None:
        """Follows none."""


class Backend:
    """Predictions for tasks."""

    def __init__(self, server: str, label_studio: str, token: str, parameters: dict[str, str]) -> None:
        query = urlencode(parameters | {"format": "labelstudio", "oriented": "true"})
        self.detect = f"{server.rstrip('/')}/detect?{query}"
        self.label_studio = f"{label_studio.rstrip('/')}/"
        self.token = token

    def predictions(self, tasks: list[dict]) -> Iterator[dict]:
        """Yields the prediction for each task."""
        for task in tasks:
            request = Request(self.detect, data=self.image(task["data"]["image"]))
            with urlopen(request, timeout=TIMEOUT_SECONDS) as answer:
                yield json.load(answer)[0]["predictions"][0]

    def image(self, address: str) -> bytes:
        """Returns an image of Label Studio."""
        url = urljoin(self.label_studio, address)
        if not url.startswith(self.label_studio):
            raise ValueError(f"image: {address} is not at {self.label_studio}: upload it to Label Studio")
        request = Request(url, headers={"Authorization": f"Token {self.token}"})
        with build_opener(NoRedirects).open(request, timeout=TIMEOUT_SECONDS) as answer:
            content = answer.read(MAX_IMAGE_BYTES + 1)
        if len(content) > MAX_IMAGE_BYTES:
            raise ValueError(f"image: {address} is larger than {MAX_IMAGE_BYTES} bytes: send a smaller one")
        return content


class Handler(BaseHTTPRequestHandler):
    """The routes that Label Studio calls."""

    backend: Backend

    def do_GET(self) -> None:
        """Answers the health check."""
        self.answer(200, {"status": "UP", "model_class": "lookdown"})

    def do_POST(self) -> None:
        """Answers `/setup` with the version of the model, and `/predict` with predictions."""
        length = int(self.headers.get("Content-Length", 0))
        if length > MAX_REQUEST_BYTES:
            self.answer(413, {"error": f"the body is larger than {MAX_REQUEST_BYTES} bytes: send fewer tasks"})
            return
        body = json.loads(self.rfile.read(length) or "{}")
        if self.path != "/predict":
            self.answer(200, {"model_version": "lookdown"})
            return
        try:
            results = list(self.backend.predictions(body["tasks"]))
        except (OSError, KeyError, ValueError) as error:
            self.answer(502, {"error": str(error)})
            return
        self.answer(200, {"results": results, "model_version": "lookdown"})

    def answer(self, status: int, content: dict) -> None:
        """Writes a JSON response."""
        body = json.dumps(content).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


def main() -> None:
    """Serves until it is stopped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--server", default="http://localhost:8080", help="address of Lookdown")
    parser.add_argument("--calibration", help="ID of the calibration of all images")
    parser.add_argument("--profile", default="quality", help="profile of the detection")
    parser.add_argument("--port", type=int, default=9090, help="port on 127.0.0.1")
    options = parser.parse_args()
    parameters = {"profile": options.profile}
    if options.calibration:
        parameters["calibration"] = options.calibration
    label_studio = os.environ.get("LABEL_STUDIO_URL", "http://localhost:8081")
    token = os.environ.get("LABEL_STUDIO_TOKEN", "")
    Handler.backend = Backend(options.server, label_studio, token, parameters)
    ThreadingHTTPServer(("127.0.0.1", options.port), Handler).serve_forever()


if __name__ == "__main__":
    main()
