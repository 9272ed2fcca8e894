"""Reads manifests (YAML) and writes them as a list (JSON), once each is valid: run by the Python that has the schemas.

Kubernetes' own kinds are held against its schemas, strictly; custom resources against the schema beside this file.
"""

import json
import sys
from pathlib import Path

import jsonschema
import kubernetes_validate
import yaml

VERSION = kubernetes_validate.latest_version()


def problem_of(document: dict) -> str | None:
    """What is wrong with a manifest, if anything is."""
    schema = Path(__file__).with_name(f"{document['kind']}.schema.json")
    try:
        if schema.exists():
            jsonschema.validate(document, json.loads(schema.read_text(encoding="utf-8")))
        else:
            kubernetes_validate.validate(document, VERSION, strict=True)
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
