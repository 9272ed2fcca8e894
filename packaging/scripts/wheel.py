"""Builds the Python wheel: `wheel.py [PROFILE]`, after the step `wheel` of the set-up.

`PROFILE` is one of Cargo.toml, by default `release`, into target/wheels. Any other one is for tests, and its wheel goes
into target/PROFILE/wheels. The wheel has the default models inside and takes ONNX Runtime from its own package. It is
linked for glibc 2.28 with zig, so that it runs on every distribution since 2018.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from dist import ROOT, model_files

CRATE = ROOT / "crates" / "lookdown-python"
TOOLS = ROOT / ".setup" / "wheel" / "bin"
PLATFORM = "manylinux_2_28"


def main(profile: str = "release") -> int:
    """Collects the models, builds the wheel, and checks its platform."""
    wheels = ROOT / "target" / ("wheels" if profile == "release" else f"{profile}/wheels")
    collect_models(CRATE / "python" / "lookdown")
    for text in ("LICENSE", "NOTICE"):
        shutil.copyfile(ROOT / text, CRATE / text)
    shutil.rmtree(wheels, ignore_errors=True)
    environment = os.environ | {"PATH": f"{TOOLS}:{os.environ['PATH']}"}
    flags = ["--profile", profile, "--locked", "--zig", "--compatibility", PLATFORM, "--out", wheels]
    built = subprocess.run([TOOLS / "maturin", "build", *flags], cwd=CRATE, env=environment, check=False)
    if built.returncode != 0:
        return built.returncode
    (wheel,) = wheels.glob("*.whl")
    shown = subprocess.run([TOOLS / "auditwheel", "show", wheel], stdout=subprocess.PIPE, text=True, check=True).stdout
    if f'"{PLATFORM}_x86_64"' not in shown.replace("\n", " "):
        print(f"{wheel.name}: auditwheel does not find it fit for {PLATFORM}:\n{shown}", file=sys.stderr)
        return 1
    print(f"{wheel.relative_to(ROOT)}: {wheel.stat().st_size / 1e6:.1f} MB")
    return 0


def collect_models(package: Path) -> None:
    """Copies our networks with their manifests and license into the package."""
    shutil.rmtree(package / "models", ignore_errors=True)
    for source, name in model_files(ROOT):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, package / name)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
