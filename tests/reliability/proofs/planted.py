"""Files that others leave where a user works: a library and models in the current folder, a playlist under the name of
a video, and a pipe in the place of a model."""

import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from harness.places import LOOKDOWN, ROOT, SAMPLES
from harness.processes import Server
from support.effort import Effort
from support.exchange import ask
from support.lookdown import lookdown
from support.row import Row

MODEL = "nanodet_g_views_416"
"""The model whose folder is copied."""
LONGEST_SECONDS = 10.0
"""Longest time of a refusal."""


def prove(_: Effort) -> list[Row]:
    """Returns a row for each kind of file."""
    with tempfile.TemporaryDirectory() as folder:
        return [_current_folder(Path(folder)), _playlist(Path(folder)), _pipe(Path(folder))]


def _run(arguments: list, folder: Path) -> subprocess.CompletedProcess:
    command = [LOOKDOWN, *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=60)


def _current_folder(folder: Path) -> Row:
    row = Row("planted library and models", "`model check` and `detect` in a folder with runtime/ and models/")
    here = folder / "untrusted"
    (here / "runtime").mkdir(parents=True)
    (here / "runtime" / "libonnxruntime.so").write_bytes(b"not a library")
    (here / "models" / MODEL).mkdir(parents=True)
    (here / "models" / MODEL / "model.toml").write_text("planted", encoding="utf-8")
    checked = _run(["model", "check", ROOT / "models" / MODEL], here)
    detected = _run(["detect", SAMPLES / "office.jpg", "--profile", "fast"], here)
    reports = detected.stdout.count("\n")
    row.seen = f"exit status {checked.returncode}, {reports} report"
    row.require(checked.returncode == 0, f"model check fails: {checked.stderr[-300:]}")
    row.require(reports == 1, f"detect fails: {detected.stderr[-300:]}")
    return row


def _playlist(folder: Path) -> Row:
    row = Row("playlists as videos", "an HLS and a concat playlist named clip.mp4")
    if not shutil.which("ffmpeg"):
        row.skipped = "there is no ffmpeg"
        return row
    other = folder / "other.ts"
    frames = ["-loop", "1", "-i", SAMPLES / "office.jpg", "-t", "2", "-r", "5", "-pix_fmt", "yuv420p"]
    scaled = ["-vf", "scale=640:640", "-f", "mpegts", other]
    subprocess.run(["ffmpeg", "-v", "error", *frames, *scaled], check=True)
    reports = 0
    for text in (
        f"#EXTM3U\n#EXT-X-TARGETDURATION:2\n#EXTINF:2,\n{other}\n#EXT-X-ENDLIST\n",
        "ffconcat version 1.0\nfile other.ts\n",
    ):
        clip = folder / "clip.mp4"
        clip.write_text(text, encoding="utf-8")
        done = _run(["detect", clip, "--every", "1s", "--profile", "fast"], folder)
        reports += done.stdout.count("\n")
        row.require(done.returncode != 0, "the playlist is accepted")
    row.seen = f"{reports} reports of the other file"
    row.require(reports == 0, "another file is read")
    return row


def _pipe(folder: Path) -> Row:
    row = Row("a pipe as model.onnx", "loads of a model that is a pipe, and of another one behind it")
    repository = folder / "repository"
    planted = repository / "pipe"
    shutil.copytree(ROOT / "models" / MODEL, repository / MODEL)
    planted.mkdir()
    manifest = (ROOT / "models" / MODEL / "model.toml").read_text(encoding="utf-8").splitlines()
    lines = ['name = "pipe"' if line.startswith("name =") else line for line in manifest if "sha256" not in line]
    (planted / "model.toml").write_text("\n".join(lines), encoding="utf-8")
    os.mkfifo(planted / "model.onnx")
    settings = {"MODEL__REPOSITORY": str(repository), "MODEL__PATH": str(repository / MODEL)}
    with lookdown(settings) as server:
        refused, seconds = _load(server, "pipe")
        other, _ = _load(server, MODEL)
    row.seen = f"status {refused} after {seconds:.1f} s, then {other}"
    row.require(refused >= 400, "the pipe is loaded")
    row.require(seconds < LONGEST_SECONDS, "the load waits for a writer")
    row.require(other == 200, "the load of another model waits")
    return row


def _load(server: Server, model: str) -> tuple[int, float]:
    began = time.monotonic()
    answer = ask(server.address, "POST", f"/v2/repository/models/{model}/load", json.dumps({}).encode())
    return answer.status, time.monotonic() - began
