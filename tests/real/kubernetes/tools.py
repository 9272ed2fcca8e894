"""The tools of a cluster: kustomize (in kubectl), the schemas of Kubernetes, promtool."""

import json
from pathlib import Path

from commands import run
from harness.places import ROOT

PYTHON = ROOT / ".setup" / "real" / "kubernetes" / "bin"
VALIDATE = Path(__file__).with_name("validate.py")


def kustomized(folder: Path) -> str:
    """The manifests that kustomize makes of a folder."""
    return run(PYTHON / "kubectl", "kustomize", folder)


def manifests(folder: str) -> list[dict]:
    """The manifests of a folder of `k8s`, each validated."""
    return json.loads(run(PYTHON / "python", VALIDATE, given=kustomized(ROOT / "k8s" / folder)))


def read_yaml(file: Path) -> dict:
    """A YAML file that is not a manifest."""
    return json.loads(run(PYTHON / "python", VALIDATE, "--only-read", given=file.read_text(encoding="utf-8")))[0]


def only(documents: list[dict], kind: str) -> dict:
    """The only manifest of a kind."""
    (found,) = [document for document in documents if document["kind"] == kind]
    return found
