"""Hostile HTTP cameras beside a good one: responses that never begin, and large frames of many cameras."""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from harness.places import LOOKDOWN
from harness.processes import free_ports, running
from support.cameras import http_camera
from support.companion import metric
from support.effort import Effort
from support.lookdown import TINY, lookdown
from support.row import Row

SECONDS = 15.0
MAX_CORES = 0.5
"""Most CPU time of `lookdown watch` beside cameras whose responses never begin; without a limit one core for each."""
MIN_FRAMES = 8
"""Fewest frames of the good camera, which has one each second."""
LARGE_CAMERAS = 80
MAX_MEBIBYTES = 600
"""The budget of all frames, 512 MiB, and the program with what it reads."""


@dataclass
class Watched:
    """What `lookdown watch` used."""

    cores: float
    peak_mebibytes: int
    frames: float
    log: str


def prove(_: Effort) -> list[Row]:
    """Returns a row for each kind of camera."""
    with lookdown(TINY) as server, http_camera() as camera:
        return [_provisional(server.address, camera), _large(server.address, camera)]


def _provisional(target: str, camera: str) -> Row:
    row = Row("endless provisional responses", "2 HTTP cameras that send 100 Continue without end, beside a good one")
    used = _watch(target, [f"{camera}/good", f"{camera}/provisional/1", f"{camera}/provisional/2"])
    row.seen = f"{used.cores:.2f} cores; {used.frames:.0f} frames of the good camera in {SECONDS:.0f} s"
    row.require(used.cores <= MAX_CORES, "the responses keep a core busy")
    row.require(used.frames >= MIN_FRAMES, "the good camera is disturbed")
    row.require("provisional responses" in used.log, "the log has no reason")
    return row


def _large(target: str, camera: str) -> Row:
    row = Row("large frames of many cameras", f"{LARGE_CAMERAS} MJPEG cameras with parts of 12 MiB, beside a good one")
    large = [f"{camera}/large/{number}" for number in range(LARGE_CAMERAS)]
    used = _watch(target, [f"{camera}/good", *large])
    row.seen = f"at most {used.peak_mebibytes} MiB; {used.frames:.0f} frames of the good camera in {SECONDS:.0f} s"
    row.require(used.peak_mebibytes <= MAX_MEBIBYTES, "the frames exceed their budget")
    row.require(used.frames >= MIN_FRAMES / 2, "the good camera is disturbed")
    return row


def _watch(target: str, urls: list[str]) -> Watched:
    """Watches cameras; the first one is the good one."""
    (port,) = free_ports(1)
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder) / "watch.toml"
        cameras = [f'[[cameras]]\nname = "camera{number}"\nurl = "{url}"\n' for number, url in enumerate(urls)]
        head = f'[upstream]\nurl = "http://{target}"\n[camera_defaults]\nevery = "1s"\n'
        settings.write_text(head + "".join(cameras), encoding="utf-8")
        command = [str(LOOKDOWN), "watch", str(settings), "--metrics-listen", f"127.0.0.1:{port}"]
        with running("watch", command, port, "/metrics", {}) as watch:
            time.sleep(SECONDS)
            sent = metric(watch.address, 'lookdown_watch_frames_sent_total{camera="camera0"}')
            cores = watch.usage().cpu_seconds / SECONDS
            status = Path(f"/proc/{watch.pid}/status").read_text(encoding="utf-8")
            log = watch.log.read_text(encoding="utf-8", errors="replace")
    peak = next(line for line in status.splitlines() if line.startswith("VmHWM:"))
    return Watched(cores, int(peak.split()[1]) // 1024, sent, log)
