"""The service conforms to its OpenAPI document: schemathesis generates valid and invalid requests and follows links."""

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from support.effort import Effort
from support.lookdown import TINY, lookdown
from support.places import OWN, ROOT, SAMPLES, SCHEMATHESIS, WORK
from support.row import Row

HERE = Path(__file__).resolve().parents[1]
CASES = re.compile(r"([\d,]+) generated")
FAILURE = re.compile(r"^- (.+)$", re.MULTILINE)
OWN_ERROR = re.compile(r"^ +🚫 (.+: \d+)$", re.MULTILINE)
LINKS = re.compile(r"API Links: +(.+)$", re.MULTILINE)
ENDS = {0: "held", 1: "failures"}


def prove(effort: Effort) -> list[Row]:
    """Runs once with all checks and in all phases."""
    row = Row(
        "the OpenAPI document", f"schemathesis, all checks, up to {effort.examples} examples per operation and phase"
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "calibrations"
        shutil.copytree(SAMPLES / "calibrations", folder)
        settings = TINY | {"STATE__PATH": str(Path(name) / "state")}
        with lookdown(settings, calibrations=folder) as server:
            code, said = _schemathesis(f"http://{server.address}/openapi.json", effort, Path(name))
            alive = server.process.poll() is None
    WORK.mkdir(parents=True, exist_ok=True)
    (WORK / "schemathesis.log").write_text(said, encoding="utf-8")
    cases, links = CASES.search(said), LINKS.search(said)
    row.seen = f"{cases[1] if cases else 'no'} requests; links: {links[1] if links else 'none'}"
    row.faults += sorted(set(FAILURE.findall(said)))
    row.faults += [f"schemathesis failed ({error})" for error in OWN_ERROR.findall(said)]
    row.require(alive, "the server ended")
    row.require(code == 0 or bool(row.faults), f"schemathesis ended with {code}: see {WORK.relative_to(ROOT)}")
    return [row]


def _schemathesis(document: str, effort: Effort, folder: Path) -> tuple[int, str]:
    seeds = ["--generation-deterministic"] if effort.deterministic else ["--generation-database", "none"]
    command = [
        *(str(SCHEMATHESIS), "--config-file", str(HERE / "schemathesis.toml"), "run", document, "--no-color"),
        *("--checks", "all", "--max-examples", str(effort.examples), "--continue-on-failure", "--no-shrink", *seeds),
    ]
    environment = os.environ | {"SCHEMATHESIS_HOOKS": "contract_hooks", "PYTHONPATH": str(HERE), "HOME": str(OWN)}
    answer = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    return answer.returncode, answer.stdout + answer.stderr
