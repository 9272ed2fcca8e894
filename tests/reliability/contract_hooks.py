"""Hooks for schemathesis: data that it cannot generate from the OpenAPI document, such as images and calibrations."""

import json
import re
from pathlib import Path

import schemathesis
from hypothesis import strategies

FIXTURES = Path(__file__).resolve().parents[1] / "fixtures"
DOCUMENT = json.loads((FIXTURES.parents[1] / "openapi" / "openapi.json").read_text(encoding="utf-8"))
CALIBRATIONS = sorted(file for file in (FIXTURES / "calibrations").iterdir() if file.suffix != ".py")
IMAGES = {
    "image/jpeg": sorted((FIXTURES / "images").glob("*.jpg")),
    "image/png": [file for file in sorted((FIXTURES / "images").glob("*.png")) if file.name != "huge.png"],
    "image/webp": sorted((FIXTURES / "images").glob("*.webp")),
}


def contents(files: list[Path]) -> strategies.SearchStrategy[bytes]:
    """A strategy for the content of one of the files."""
    return strategies.sampled_from([file.read_bytes() for file in files])


HEAD_LENGTH = "Inference-Header-Content-Length"
CALIBRATIONS_ARE_SENT = {"PUT /calibrations/{id}", "POST /calibrations/{id}/views"}
NUMBER = re.compile(r"-?\d+(\.\d+)?([eE][-+]?\d+)?")
READS_AS = {"number": NUMBER, "integer": NUMBER, "boolean": re.compile("true|false", re.IGNORECASE)}
EXAMPLE = "the bytes of frame.jpg"
"""The image in the examples of forms. DeepStack's routes refuse it with 400, which is permitted."""
CONDITION = re.compile(r'\*|"[!#-~]*"')
ANY_IMAGE = contents([file for files in IMAGES.values() for file in files])
for media_type, files in IMAGES.items():
    schemathesis.openapi.media_type(media_type, contents(files))
schemathesis.openapi.media_type("application/octet-stream", ANY_IMAGE)
schemathesis.openapi.format("binary", ANY_IMAGE)


@schemathesis.hook
def filter_case(context, case):
    """Drops generated cases that were meant to be invalid but are valid, and those of methods that share a path."""
    if case.operation.path.endswith("/views/{name}.jpg") and case.method != "GET":
        # The router has one path for a view and its image, so their methods are those of both.
        return False
    if case.media_type != "multipart/form-data" or not isinstance(case.body, dict):
        return True
    fields = form_fields(case.operation)
    return not any(reads_well(name, case.body[name], fields[name]) for name in fields.keys() & case.body.keys())


def form_fields(operation):
    """The fields of an operation's form, by name."""
    form = DOCUMENT["paths"][operation.path][operation.method.lower()]["requestBody"]["content"]["multipart/form-data"]
    return {name: schema(field) for name, field in schema(form["schema"])["properties"].items()}


def schema(declared):
    """The schema itself, or the component that it refers to."""
    return DOCUMENT["components"]["schemas"][declared["$ref"].rsplit("/", 1)[-1]] if "$ref" in declared else declared


def reads_well(name, value, field):
    """Returns true if a value of the wrong type is valid as form text. In a form everything is text: a list is its
    items and an item is a list, null is a word, and quoted digits are a number. DeepStack's clients send an empty text
    for a confidence that they leave out."""
    if field["type"] == "array":
        return not isinstance(value, list)
    if isinstance(value, list) or (name, value) == ("min_confidence", ""):
        return True
    if field["type"] == "string":
        return not isinstance(value, str | bytes) and field.get("format") != "binary"
    return isinstance(value, str) and READS_AS[field["type"]].fullmatch(value) is not None


@schemathesis.hook
def before_call(context, case, kwargs):
    """Keeps each parameter in the form or in the query only, and at most one condition."""
    if case.meta is None or not case.meta.generation.mode.is_positive:
        return
    if case.media_type == "multipart/form-data" and isinstance(case.body, dict):
        if case.path == "/detect" and case.body.get("img") in (EXAMPLE, EXAMPLE.encode()):
            case.body["img"] = IMAGES["image/jpeg"][0].read_bytes()
        if case.body.get("img") == []:
            # The document has the least number of files in words only.
            case.body["img"] = [IMAGES["image/jpeg"][0].read_bytes()]
        case.query = {name: value for name, value in (case.query or {}).items() if name not in case.body}
    if case.method == "PUT":
        # No file has a camera with a generated name, and most contain their size.
        case.query = {}
    if case.operation.label in CALIBRATIONS_ARE_SENT:
        case.body = CALIBRATIONS[len(repr(case.body)) % len(CALIBRATIONS)].read_bytes()
        case.media_type = "application/octet-stream"
    if case.path.endswith("/infer"):
        send_tensors(case)
    conditions = [name for name in ("If-Match", "If-None-Match") if name in (case.headers or {})]
    for name in conditions:
        # schemathesis 4.32 does not support patterns of headers.
        if len(conditions) > 1 or not CONDITION.fullmatch(case.headers[name]):
            case.headers.pop(name)


def send_tensors(case):
    """Sets the length of the JSON, and appends byte tensors with an image after the JSON."""
    if case.headers is None:
        case.headers = {}
    case.headers.pop(HEAD_LENGTH, None)
    if case.media_type == "application/octet-stream" and isinstance(case.body, bytes):
        size = {"binary_data_size": len(case.body) + 4}
        tensor = {"name": "image", "datatype": "BYTES", "shape": [1], "parameters": size}
        head = json.dumps({"inputs": [tensor]}).encode()
        case.body = head + len(case.body).to_bytes(4, "little") + case.body
        case.headers[HEAD_LENGTH] = str(len(head))
