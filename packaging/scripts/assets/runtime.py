"""ONNX Runtime: a library inside one wheel, which `pip download` fetches and a pinned sum identifies."""

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path

from .console import SetupError, run, say

PINS = Path(__file__).resolve().parents[1] / "pins.toml"
LIBRARY = "libonnxruntime.so"
LICENSES = ("LICENSE", "ThirdPartyNotices.txt")
LOAD_LIBRARY = "import ctypes, sys; ctypes.CDLL(sys.argv[1]).OrtGetApiBase"
NO_PIP = (
    "The set-up needs pip, which this Python does not have; install it (Debian and Ubuntu: apt-get install "
    "python3-venv) and run the set-up again."
)


@dataclass(frozen=True)
class Runtime:
    """The pinned wheel for one CPU family, with the sum of the library in it."""

    version: str
    file: str
    bytes: int
    sha256: str
    library_sha256: str


def pinned_runtime(cpu: str) -> Runtime:
    """The wheel for a CPU family, `x86_64` or `aarch64`."""
    pins = tomllib.loads(PINS.read_text(encoding="utf-8"))["runtime"]
    return Runtime(version=pins["version"], **pins[cpu])


def install_runtime(runtime: Runtime, folder: Path, downloads: Path) -> None:
    """Puts the library and its licenses into `folder`; the wheel stays in `downloads`."""
    if not has_sum(folder / LIBRARY, runtime.library_sha256):
        wheel = fetch(runtime, downloads)
        folder.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(wheel) as opened:
            for name in LICENSES:
                (folder / name).write_bytes(opened.read(f"onnxruntime/{name}"))
            # Complete before it has its name: a server may start meanwhile.
            unfinished = folder / f"{LIBRARY}.unfinished"
            with opened.open(f"onnxruntime/capi/{LIBRARY}.{runtime.version}") as source, open(unfinished, "wb") as to:
                shutil.copyfileobj(source, to, 1 << 20)
            os.replace(unfinished, folder / LIBRARY)
    say("runtime", f"ONNX Runtime {runtime.version} is in place")


def fetch(runtime: Runtime, downloads: Path) -> Path:
    """The wheel, fetched once."""
    wheel = downloads / runtime.file
    if has_sum(wheel, runtime.sha256):
        return wheel
    say("runtime", f"fetching ONNX Runtime {runtime.version} with pip ({runtime.bytes / 1e6:.1f} MB)")
    unfinished = downloads / "unfinished"
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    package, version, python, abi, platform = runtime.file.removesuffix(".whl").split("-")
    by_hand = f"put {runtime.file} (sha256 {runtime.sha256}) into {downloads}"
    flags = ["--no-deps", "--only-binary=:all:", "--no-cache-dir", "--dest=."]
    target = [f"--platform={platform}", f"--python-version={python[2:]}", "--implementation=cp", f"--abi={abi}"]
    run(
        [*pip(), "download", *flags, *target, f"{package}=={version}"],
        unfinished,
        f"pip could not fetch ONNX Runtime: check the network and pip's index settings, or {by_hand}. pip said:",
    )
    fetched = unfinished / runtime.file
    if not has_sum(fetched, runtime.sha256):
        shutil.rmtree(unfinished)
        raise SetupError(f"The fetched {runtime.file} is not the pinned file; ask who runs your mirror, or {by_hand}.")
    os.replace(fetched, wheel)
    unfinished.rmdir()
    return wheel


def require_loadable(folder: Path) -> None:
    """Loads the library as the server does, in a separate process."""
    command = [sys.executable, "-c", LOAD_LIBRARY, str(folder / LIBRARY)]
    loaded = subprocess.run(command, capture_output=True, text=True, check=False)
    if loaded.returncode != 0:
        reason = (loaded.stderr.strip().splitlines() or [f"exit status {loaded.returncode}"])[-1]
        raise SetupError(
            f"ONNX Runtime cannot be loaded: {reason}. If libstdc++.so.6 is missing, install it (Debian and Ubuntu: "
            "apt-get install libstdc++6) and run the set-up again."
        )


def pip() -> list[str]:
    """The command that runs pip, without installing it: the system's, or the one that `venv` would install."""
    if importlib.util.find_spec("pip"):
        return [sys.executable, "-m", "pip"]
    ensurepip = importlib.util.find_spec("ensurepip")
    # Debian has the wheels of ensurepip in a folder of their own.
    folders = [Path("/usr/share/python-wheels"), Path(sysconfig.get_config_var("WHEEL_PKG_DIR") or "")]
    if ensurepip and ensurepip.origin:
        folders.append(Path(ensurepip.origin).parent / "_bundled")
    for folder in folders:
        for wheel in sorted(folder.glob("pip-*.whl")):
            return [sys.executable, str(wheel / "pip")]
    raise SetupError(NO_PIP)


def has_sum(file: Path, sha256: str) -> bool:
    """Returns True if the file exists with this content."""
    return file.is_file() and sha256_of(file) == sha256


def sha256_of(file: Path) -> str:
    """The sum of a file, in hexadecimal."""
    with open(file, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
