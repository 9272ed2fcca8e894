"""Average precision on a data set."""

import json
import os
import subprocess
import sys
from typing import Any

from lookdown._lookdown import LookdownError


def evaluate(data_set: str | os.PathLike[str], *, profile: str = "balanced", refine: str = "fusion") -> dict[str, Any]:
    """Runs a profile on a data set and returns the row of `lookdown eval --json`: `ap50`, `ap75` and others.

    `data_set` is a folder or an annotation file in one of the formats of docs/evaluate.md. Progress is shown on standard
    error.
    """
    flags = ["--profile", profile, "--refine", refine, "--json"]
    command = [sys.executable, "-m", "lookdown", "eval", os.fspath(data_set), *flags]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        raise LookdownError(f"data_set: {os.fspath(data_set)} was not evaluated; standard error says why")
    row: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return row
