"""The tools of a cluster: kustomize (in kubectl), the schemas of Kubernetes, promtool."""

import json
import subprocess
from pathlib import Path

from harness.places import ROOT

PYTHON = ROOT / ".setup" / "real" / "kubernetes" / "bin"
VALIDATE = Path(__file__).with_name("validate.py")


class Refused(AssertionError):
    """A tool does not take what it was given; the message is what it said."""


def run(command: list, stdin: str | None = None) -> str:
    """What a tool prints."""
    answer = subprocess.run(list(map(str, command)), input=stdin, capture_output=True, text=True, check=False)
    if answer.returncode:
        raise Refused(f"{Path(command[0]).name}: {answer.stdout}{answer.stderr}")
    return answer.stdout


def manifests(folder: str) -> list[dict]:
    """What would be applied of a folder of `k8s`, each manifest valid."""
    return json.loads(run([PYTHON / "python", VALIDATE], run([PYTHON / "kubectl", "kustomize", ROOT / "k8s" / folder])))


def read_yaml(file: Path) -> dict:
    """A YAML file that is no manifest."""
    return json.loads(run([PYTHON / "python", VALIDATE, "--only-read"], file.read_text(encoding="utf-8")))[0]


def only(documents: list[dict], kind: str) -> dict:
    """The one manifest of a kind."""
    (found,) = [document for document in documents if document["kind"] == kind]
    return found
