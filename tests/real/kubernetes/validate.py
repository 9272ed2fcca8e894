"""Validates manifests (YAML) and prints them as a list (JSON). It is run by the Python that has the schemas.

Kubernetes' own kinds are validated strictly against its schemas, custom resources against the schema in this folder.
"""

import json
import sys
from pathlib import Path

import jsonschema
import kubernetes_validate
import yaml

VERSION = kubernetes_validate.latest_version()


def problem_of(document: dict) -> str | None:
    """The problem of a manifest, or None."""
    schema = Path(__file__).with_name(f"{document['kind']}.schema.json")
    try:
        if schema.exists():
            jsonschema.validate(document, json.loads(schema.read_text(encoding="utf-8")))
        else:
            kubernetes_validate.validate(document, VERSION, strict=True)
        if document["kind"] == "ServingRuntime":
            pod = {"apiVersion": "v1", "kind": "Pod", "metadata": {"name": "any"}}
            spec = {"containers": document["spec"]["containers"]}
            kubernetes_validate.validate(pod | {"spec": spec}, VERSION, strict=True)
    except (jsonschema.ValidationError, kubernetes_validate.ValidationError) as error:
        return f"{'.'.join(str(part) for part in error.path)}: {error.message}"
    except kubernetes_validate.SchemaNotFoundError:
        return "there is no schema of this kind"
    return None


documents = [document for document in yaml.safe_load_all(sys.stdin) if document]
if "--only-read" not in sys.argv:
    problems = [(document["kind"], problem_of(document)) for document in documents]
    told = [f"{kind}: {problem}" for kind, problem in problems if problem]
    if told:
        sys.exit("\n".join(told))
json.dump(documents, sys.stdout)
