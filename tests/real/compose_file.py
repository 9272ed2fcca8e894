"""docker/compose.yaml as Docker Compose reads it: validated, with the variables filled in."""

import json
import os
import re

from commands import run
from harness.places import ROOT
from kubernetes.tools import PYTHON, VALIDATE

DOCKER = ROOT / "docker"
COMMAND = ["docker-compose", "--file", "-", "--profile=monitoring", "config"]


def services(**variables: str) -> dict[str, dict]:
    """The services with these variables."""
    text = (DOCKER / "compose.yaml").read_text(encoding="utf-8")
    # Debian's Docker Compose is of version 1, which knows no name of a project.
    nameless = re.sub(r"^name:.*\n", "", text, flags=re.MULTILINE)
    filled = run(*COMMAND, given=nameless, cwd=DOCKER, environment=os.environ | variables)
    (document,) = json.loads(run(PYTHON / "python", VALIDATE, "--only-read", given=filled))
    return document["services"]


def environment(service: dict) -> dict[str, str]:
    """The variables of a service. The output of `config` has each dollar sign twice."""
    return {name: value.replace("$$", "$") for name, value in service["environment"].items()}
