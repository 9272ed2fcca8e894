"""Triton Inference Server, as the wheel `nvidia-pytriton` contains it, with a network in its Python backend."""

import contextlib
import glob
import os
import shutil
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from pathlib import Path

from harness.places import ROOT, model
from harness.processes import Server, running

HERE = Path(__file__).resolve().parent
PYTHON = ROOT / ".setup" / "real" / "triton"
VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"
PARTS = PYTHON / "lib" / f"python{VERSION}" / "site-packages" / "pytriton" / "tritonserver"
STUB = PARTS / "python_backend_stubs" / VERSION / "triton_python_backend_stub"
"""The process that runs a model of the Python backend; it is there for Python 3.11 and 3.12 (requirements/triton.txt)."""


@contextlib.contextmanager
def triton(port: int, network: str) -> Iterator[Server]:
    """Triton with a network of `models` under the name `people`. Clients may load and unload it."""
    memory = f"lookdown-triton-{os.getpid()}-{port}"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(HERE / "triton", folder / "models")
        backend = folder / "backends" / "python"
        backend.mkdir(parents=True)
        for part in (*(PARTS / "backends" / "python").iterdir(), STUB):
            (backend / part.name).symlink_to(part)
        command = [
            *(str(PARTS / "bin" / "tritonserver"), f"--model-repository={folder / 'models'}"),
            *(f"--backend-directory={backend.parent}", f"--backend-config=python,shm-region-prefix-name={memory}"),
            *("--model-control-mode=explicit", "--load-model=people"),
            *("--http-address=127.0.0.1", f"--http-port={port}", "--allow-grpc=false", "--allow-metrics=false"),
        ]
        # The backend ignores PYTHONPATH: it uses the packages of the first Python of PATH.
        environment = {
            "MODEL": str(model(network)),
            "PATH": f"{PYTHON / 'bin'}:{os.environ['PATH']}",
            "LD_LIBRARY_PATH": sysconfig.get_config_var("LIBDIR"),
        }
        try:
            with running("triton", command, port, "/v2/models/people/ready", environment, folder) as server:
                yield server
        finally:
            # A killed Triton leaves its shared memory.
            for region in glob.glob(f"/dev/shm/{memory}*"):
                os.unlink(region)
