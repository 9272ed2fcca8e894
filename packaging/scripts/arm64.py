"""Cross-builds Lookdown for arm64, tests it with an emulator and packs it into target/dist: `arm64.py [build|test|pack]...`,
all by default.

Debian 12 on x86-64 has all parts: Rust with its arm64 library (`rustc-web`), the cross compiler and qemu. The arm64
library is unpacked below .setup/arm64, so that the system needs no foreign architecture. ONNX Runtime comes from the
pinned wheel. The tests are those of the libraries, then the samples through the whole program.
"""

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

from assets.runtime import LIBRARY, install_runtime, pinned_runtime
from dist import make_dist

ROOT = Path(__file__).resolve().parents[2]
OWN = ROOT / ".setup" / "arm64"
CPU = "aarch64"
TARGET = "aarch64-unknown-linux-gnu"
PROGRAM = ROOT / "target" / TARGET / "release" / "lookdown"
RUSTC = Path("/usr/bin/rustc")
"""Of the package rustc-web; rustup's compiler cannot use Debian's library."""
PACKAGES = ("rustc-web", "gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross", "libstdc++6-arm64-cross", "qemu-user-static")
VARIABLES = "ORT_DISABLE_TELEMETRY=1,MALLOC_MMAP_THRESHOLD_=131072"
EMULATOR = ("qemu-aarch64-static", "-E", VARIABLES, "-L", "/usr/aarch64-linux-gnu")
"""With the variables of src/main.rs: an emulated program cannot replace itself to set them."""
HIDE_CPU = ("unshare", "--mount", "sh", "-c", 'mount -t tmpfs none /sys && exec "$@"', "sh")
"""Runs a command without /sys: ONNX Runtime would crash while it reads there about the caches of x86-64. Needs root."""
RECORD = ROOT / "tests" / "fixtures" / "sample_persons.json"
LIBRARIES = ("lookdown-lens", "lookdown-calibration", "lookdown-imaging", "lookdown-detect", "lookdown-eval")


def main(arguments: list[str]) -> int:
    """The exit status."""
    subprocess.run([ROOT / "packaging" / "scripts" / "packages.sh", *PACKAGES], check=True)
    install_rust_library()
    install_runtime(pinned_runtime(CPU), OWN / "runtime", ROOT / ".setup" / "downloads")
    wanted = arguments or ["build", "test", "pack"]
    if "build" in wanted:
        cargo("build", "--release", "--bin", "lookdown")
        print(f"{PROGRAM.relative_to(ROOT)}: {PROGRAM.stat().st_size / 1e6:.1f} MB")
    if "test" in wanted:
        packages = [word for name in LIBRARIES for word in ("--package", name)]
        cargo("test", "--release", "--lib", *packages)
        detect_in_samples()
    if "pack" in wanted:
        make_dist(PROGRAM, CPU, OWN / "runtime", EMULATOR)
    return 0


def install_rust_library() -> None:
    """Unpacks Rust's standard library for arm64, of the version of the compiler, into .setup/arm64/usr."""
    version = _output("dpkg-query", "--show", "--showformat", "${Version}", "rustc-web")
    done = OWN / f"library-{version}"
    if done.exists():
        return
    shutil.rmtree(OWN, ignore_errors=True)
    (OWN / "lists" / "partial").mkdir(parents=True)
    options = [f"Dir::State::Lists={OWN / 'lists'}", "APT::Architectures::=amd64", "APT::Architectures::=arm64"]
    options = [word for option in (*options, f"Dir::Cache={OWN}") for word in ("-o", option)]
    subprocess.run(["apt-get", *options, "update", "-q"], check=True)
    package = f"libstd-rust-web-dev:arm64={version}"
    subprocess.run(["apt-get", *options, "download", "-q", package], cwd=OWN, check=True)
    (archive,) = OWN.glob("libstd-rust-web-dev_*.deb")
    subprocess.run(["dpkg-deb", "--extract", archive, OWN], check=True)
    archive.unlink()
    shutil.rmtree(OWN / "lists")
    done.touch()


def cargo(command: str, *arguments: str) -> None:
    """Runs cargo for arm64 with Debian's compiler; tests run in the emulator."""
    prefix = f"CARGO_TARGET_{TARGET.upper().replace('-', '_')}"
    environment = os.environ | {
        "RUSTC": str(RUSTC),
        f"{prefix}_LINKER": "aarch64-linux-gnu-gcc",
        f"{prefix}_RUNNER": " ".join(EMULATOR),
        f"{prefix}_RUSTFLAGS": f"--sysroot={OWN / 'usr'}",
    }
    words = ["cargo", command, "--locked", "--target", TARGET, "--target-dir", ROOT / "target", *arguments]
    subprocess.run(words, cwd=ROOT, env=environment, check=True)


def detect_in_samples() -> None:
    """Finds in the emulator the recorded persons of the samples: boxes within 2 % of their diagonal, scores within .03."""
    environment = os.environ | {"LOOKDOWN__INFERENCE__LIBRARY_PATH": str(OWN / "runtime" / LIBRARY)}
    for row in json.loads(RECORD.read_text(encoding="utf-8")):
        command = [*HIDE_CPU, *EMULATOR, PROGRAM, "detect", f"samples/{row['sample']}.jpg", *row["flags"]]
        report = subprocess.run(command, cwd=ROOT, env=environment, check=True, stdout=subprocess.PIPE).stdout
        found = [(list(person["box"].values()), person["score"]) for person in json.loads(report)["persons"]]
        for person in row["persons"]:
            same = next((other for other in found if _is_same(person, *other)), None)
            if same is None:
                sys.exit(f"{person} was not found in {row['sample']}: {found}")
            found.remove(same)
        if found:
            sys.exit(f"Other persons were found in {row['sample']}: {found}")
        print(f"{len(row['persons'])} persons in {row['sample']}")


def _is_same(person: dict, box: list[float], score: float) -> bool:
    x_min, y_min, x_max, y_max = person["box"]
    size = math.hypot(x_max - x_min, y_max - y_min)
    distance = max(abs(side - other) for side, other in zip(person["box"], box))
    return distance < 0.02 * size and abs(score - person["score"]) < 0.03


def _output(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
