"""Counts of recordings."""

import csv
import io
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence

from lookdown._lookdown import LookdownError

Path = str | os.PathLike[str]


def count(
    recordings: Path | Sequence[Path], *, calibration: Path, store: Path | None = None, step_minutes: int = 15
) -> list[dict[str, str]]:
    """Counts the persons in recordings of one camera, and returns the rows of `lookdown count --csv`.

    `pandas.DataFrame(rows)` is the table. `store` is the file of the counts, which later calls continue; without it the
    counts are only returned. It needs `ffmpeg`. Progress is shown on standard error.
    """
    paths = [recordings] if isinstance(recordings, str | os.PathLike) else recordings
    files = [os.fspath(path) for path in paths]
    flags = ["--calibration", os.fspath(calibration), "--step-minutes", str(step_minutes)]
    with tempfile.TemporaryDirectory() as folder:
        flags += ["--store", os.path.join(folder, "counts.sqlite") if store is None else os.fspath(store)]
        command = [sys.executable, "-m", "lookdown", "count", *files, *flags]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        raise LookdownError(f"recordings: {', '.join(files)} were not counted; standard error says why")
    return list(csv.DictReader(io.StringIO(done.stdout)))
