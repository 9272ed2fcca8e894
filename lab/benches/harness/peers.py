"""The peer servers, each in its own Python environment."""

import contextlib
import itertools
import json
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from .frames import calibration
from .lookdown import MODEL
from .places import PEERS, WORK, model, python_of
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


def settings(parallel: bool) -> list[Setting]:
    """The settings to search; `parallel` if the peer handles several frames in one process."""
    cores = len(os.sched_getaffinity(0))
    shares = [(1, 1, cores), (cores, 1, 1)]
    if parallel:
        shares += [(1, cores, 1), (1, 2, cores)]
    return [Setting(*share, batch) for share, batch in itertools.product(dict.fromkeys(shares), (1, 8))]


@contextlib.contextmanager
def plain_python(setting: Setting, plan: Path, refine: str) -> Iterator[Server]:
    """FastAPI, OpenCV and ONNX Runtime."""
    with python_server("plain_python", setting, PLAN=plan, CALIBRATION=calibration(), REFINE=refine) as server:
        yield server


@contextlib.contextmanager
def slicer(setting: Setting, side: int) -> Iterator[Server]:
    """`supervision`'s InferenceSlicer over the frame itself, in slices of so many pixels."""
    with python_server("slicer", setting, SLICE=side) as server:
        yield server


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


@contextlib.contextmanager
def v2_server(setting: Setting) -> Iterator[Server]:
    """MLServer with the model only."""
    http, grpc, metrics = free_ports(3)
    folder = WORK / "detector"
    folder.mkdir(parents=True, exist_ok=True)
    wanted = {"host": "127.0.0.1", "http_port": http, "grpc_port": grpc, "metrics_port": metrics, "debug": False}
    # One process: the model runs in the server process. Several: it runs in workers.
    wanted["parallel_workers"] = 0 if setting.processes == 1 else setting.processes
    (folder / "settings.json").write_text(json.dumps(wanted), encoding="utf-8")
    described = {"name": "detector", "implementation": "model.Detector"}
    (folder / "model-settings.json").write_text(json.dumps(described), encoding="utf-8")
    command = [str(python_of("v2_server").with_name("mlserver")), "start", str(folder)]
    environment = setting.environment() | {"PYTHONPATH": str(PEERS / "v2_server")}
    with running("v2_server", command, http, "/v2/models/detector/ready", environment, folder) as server:
        yield server
