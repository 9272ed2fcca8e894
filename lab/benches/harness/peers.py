"""The peer servers, each in its own Python environment."""

import contextlib
import itertools
import os
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path

from .frames import calibration
from .lookdown import CROP_MODEL, MODEL
from .places import PEERS, model, python_of
from .processes import Server, free_ports, running


@dataclass(frozen=True)
class Setting:
    """The use of cores by a peer."""

    processes: int
    frames: int
    """The number of frames that a process handles at once."""
    threads: int
    """The number of threads of one run of the network."""
    batch: int
    """The number of views per run."""

    def text(self) -> str:
        """Formats the settings for a table."""
        return (
            f"processes: {self.processes}, frames at once: {self.frames}, threads: {self.threads}, batch: {self.batch}"
        )

    def environment(self) -> dict[str, str]:
        """The environment variables of a peer."""
        return {name.upper(): str(value) for name, value in asdict(self).items()} | {"MODEL": str(model(MODEL))}


def settings() -> list[Setting]:
    """The settings to search."""
    cores = len(os.sched_getaffinity(0))
    shares = [(1, 1, cores), (cores, 1, 1), (1, cores, 1), (1, 2, cores)]
    return [Setting(*share, batch) for share, batch in itertools.product(dict.fromkeys(shares), (1, 8))]


def plain_python(setting: Setting, plan: Path, refine: str, crops: int = 0) -> AbstractContextManager[Server]:
    """FastAPI, OpenCV and ONNX Runtime."""
    own = {"CALIBRATION": calibration(), "CROP_MODEL": model(CROP_MODEL), "CROPS": crops}
    return python_server("plain_python", setting, PLAN=plan, REFINE=refine, **own)


def slicer(setting: Setting, side: int) -> AbstractContextManager[Server]:
    """`supervision`'s InferenceSlicer over the frame itself, in slices of so many pixels."""
    return python_server("slicer", setting, SLICE=side)


@contextlib.contextmanager
def python_server(name: str, setting: Setting, **own: object) -> Iterator[Server]:
    """The web server of `peers/app.py` with the detector of the peer's folder."""
    (port,) = free_ports(1)
    command = [str(python_of(name)), "-m", "uvicorn", "app:app", "--log-level", "warning"]
    command += ["--port", str(port), "--workers", str(setting.processes)]
    environment = setting.environment() | {key: str(value) for key, value in own.items()}
    environment["PYTHONPATH"] = str(PEERS / name)
    with running(name, command, port, "/ready", environment, PEERS) as server:
        yield server
