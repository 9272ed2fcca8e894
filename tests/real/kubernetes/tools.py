"""The tools of a cluster: kustomize (in kubectl), the schemas of Kubernetes, promtool."""

import json
import subprocess
from pathlib import Path

from harness.places import ROOT

PYTHON = ROOT / ".setup" / "real" / "kubernetes" / "bin"
VALIDATE = Path(__file__).with_name("validate.py")


class Refused(AssertionError):
    """A tool refuses its input. The message is its output."""


def run(command: list, stdin: str | None = None) -> str:
    """The output of a tool."""
    answer = subprocess.run(list(map(str, command)), input=stdin, capture_output=True, text=True, check=False)
    if answer.returncode:
        raise Refused(f"{Path(command[0]).name}: {answer.stdout}{answer.stderr}")
    return answer.stdout


def manifests(folder: str) -> list[dict]:
    """The manifests of a folder of `k8s`, each validated."""
    return json.loads(run([PYTHON / "python", VALIDATE], run([PYTHON / "kubectl", "kustomize", ROOT / "k8s" / folder])))


def read_yaml(file: Path) -> dict:
    """A YAML file that is not a manifest."""
    return json.loads(run([PYTHON / "python", VALIDATE, "--only-read"], file.read_text(encoding="utf-8")))[0]


def only(documents: list[dict], kind: str) -> dict:
    """The only manifest of a kind."""
    (found,) = [document for document in documents if document["kind"] == kind]
    return found
