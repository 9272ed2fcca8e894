"""Runs the fuzzers one after another: `fuzz.py [--runs N] [TARGET...]`, all targets by default.

A target stops at its first panic, at an input that takes more than a second or at more than 256 MiB of memory,
and the script then fails. Needs `cargo install cargo-fuzz` and a C++ compiler.
"""

import argparse
import re
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FUZZ = ROOT / "lab/fuzz"
IMPORTERS = re.findall(r'^    \("(\w+)", Format::', (FUZZ / "src/importer.rs").read_text(), re.MULTILINE)
# Seeds in addition to lab/fuzz/seeds/TARGET.
SEEDS = {"image_file": ["tests/fixtures/images"]} | {
    name: ["tests/fixtures/calibrations", "samples/calibrations"] for name in IMPORTERS
}
TARGETS = [*IMPORTERS, "image_file", "request", "settings", "merge"]
MAX_SECONDS = 1
MAX_MEBIBYTES = 256
# All fields of each format fit into this size; longer inputs only take more time.
MAX_BYTES = 2048


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"among {', '.join(TARGETS)}")
    parser.add_argument("--runs", type=int, default=1_000_000, help="how often each is run")
    arguments = parser.parse_args()
    for target in arguments.targets:
        if target not in TARGETS:
            parser.error(f"there is no target {target}: give some of {', '.join(TARGETS)}")
    # Parsers of untrusted bytes have no unsafe code, so no sanitizer is needed and the stable compiler suffices.
    subprocess.run(["cargo", "fuzz", "build", "--sanitizer", "none"], cwd=FUZZ, check=True)
    print("| target | executions | of them read by the importer | seconds | per second | peak MiB | findings |")
    print("|---|---|---|---|---|---|---|", flush=True)
    failed = False
    for target in arguments.targets or TARGETS:
        failed |= not fuzz(target, arguments.runs)
    return int(failed)


def fuzz(target: str, runs: int) -> bool:
    """Fuzzes a target and prints its row; returns True if there were no findings."""
    found = FUZZ / "found" / target
    found.mkdir(parents=True, exist_ok=True)
    options = [f"-runs={runs}", f"-max_len={MAX_BYTES}", f"-timeout={MAX_SECONDS}", "-print_final_stats=1"]
    options += [f"-rss_limit_mb={MAX_MEBIBYTES}", f"-artifact_prefix={found}-"]
    began = time.monotonic()
    output, healthy = run(target, [*options, found, *seeds(target)])
    seconds = time.monotonic() - began
    executions, peak = statistic("number_of_executed_units", output), statistic("peak_rss_mb", output)
    # The fuzzer samples its memory once a second, the kernel records the peak.
    healthy = healthy and peak <= MAX_MEBIBYTES
    if not healthy:
        print(output[-4000:], file=sys.stderr)
    read = re.findall(r"^read (\d+)$", output, re.MULTILINE)
    counts = [executions, read[-1] if read else "", round(seconds), round(executions / seconds), peak]
    print(f"| {' | '.join(map(str, [target, *counts, int(not healthy)]))} |", flush=True)
    return healthy


def seeds(target: str) -> list[Path]:
    folders = [FUZZ / "seeds" / target, *(ROOT / path for path in SEEDS.get(target, []))]
    return [folder for folder in folders if folder.is_dir()]


def run(target: str, arguments: list) -> tuple[str, bool]:
    """Runs the executable of a target; returns its output and its success."""
    is_importer = target in IMPORTERS
    executable = "importer" if is_importer else target
    triple = subprocess.check_output(["rustc", "-vV"], text=True).split("host: ")[1].split()[0]
    command = [FUZZ / "target" / triple / "release" / executable, *arguments]
    if is_importer:
        dictionary = FUZZ / "calibration.dict"
        command.append(f"-dict={dictionary}")
    done = subprocess.run(
        command, env={"IMPORTER": target}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, errors="replace"
    )
    return done.stderr, done.returncode == 0


def statistic(name: str, output: str) -> int:
    values = re.findall(rf"^stat::{name}:\s+(\d+)", output, re.MULTILINE)
    return int(values[-1]) if values else 0


if __name__ == "__main__":
    sys.exit(main())
