"""Hostile RTSP cameras: `lookdown watch` follows no redirection, gives its password to no host that did not ask for it,
and its decoders stay within their memory."""

import contextlib
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from harness.places import LOOKDOWN
from support.cameras import RtspServer, rtsp_server
from support.effort import Effort
from support.lookdown import TINY, lookdown
from support.row import Row

MEBIBYTE = 1 << 20
MAX_MEBIBYTES = 1100
"""The limit of a decoder, and its program."""
MANY_STREAMS = 100_000
WATCH_SECONDS = 12.0
HUGE = ["-f", "lavfi", "-i", "color=black:s=16384x8176:r=25:d=0.8", "-c:v", "libx264", "-preset", "ultrafast"]
HUGE += ["-tune", "zerolatency", "-threads", "1", "-f", "h264"]
HUGE += ["-x264-params", "ref=16:keyint=100:bframes=0:slices=1:level=6.2"]


def prove(_: Effort) -> list[Row]:
    """Returns a row for each kind of camera."""
    if not shutil.which("ffmpeg"):
        return [Row("hostile RTSP cameras", "", skipped="there is no ffmpeg")]
    with lookdown(TINY) as server:
        return [_redirection(server.address), _description(server.address), _huge_frames(server.address)]


def _redirection(target: str) -> Row:
    row = Row("RTSP redirection", "a camera that redirects to another host of the same machine")
    with rtsp_server() as other, rtsp_server(redirect=f"rtsp://127.0.0.1:{other.port}/internal") as camera:
        log = _watch(target, camera, WATCH_SECONDS / 2)[1]
        sent = sum("Authorization" in head for head in camera.heads + other.heads)
        row.seen = f"{len(camera.heads)} requests to the camera, {len(other.heads)} to the other host, {sent} passwords"
    row.require(bool(camera.heads), "the camera got no request")
    row.require(not other.heads, "the redirection was followed")
    row.require(sent == 0, "the password was sent without a challenge")
    row.require("redirects to another URL" in log, "the log has no reason")
    return row


def _description(target: str) -> Row:
    row = Row("RTSP description of many streams", f"a camera that describes {MANY_STREAMS} streams")
    with rtsp_server(streams=MANY_STREAMS) as camera:
        peak, _ = _watch(target, camera, WATCH_SECONDS)
    row.seen = f"the decoder takes {peak} MiB at most"
    row.require(peak <= MAX_MEBIBYTES // 4, "the decoder grows with the description")
    return row


def _huge_frames(target: str) -> Row:
    row = Row("huge video frames", "H.264 of 16384 x 8176 pixels with 16 reference frames")
    with tempfile.TemporaryDirectory() as folder:
        video = Path(folder) / "huge.h264"
        made = subprocess.run(["ffmpeg", "-v", "error", *HUGE, video], check=False)
        if made.returncode:
            row.skipped = "this ffmpeg has no libx264"
            return row
        with rtsp_server(video=video.read_bytes()) as camera:
            peak, _ = _watch(target, camera, WATCH_SECONDS)
    row.seen = f"the decoder takes {peak} MiB at most"
    row.require(0 < peak <= MAX_MEBIBYTES, "the decoder exceeds its limit")
    return row


def _watch(target: str, camera: RtspServer, seconds: float) -> tuple[int, str]:
    """Watches a camera. Returns the peak memory of its decoders in MiB, and the log."""
    command = [LOOKDOWN, "watch", camera.url, "--name", "hall", "--server", f"http://{target}"]
    peak = 0
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        try:
            deadline = time.monotonic() + seconds
            while time.monotonic() < deadline and process.poll() is None:
                peak = max([peak, *map(_peak_bytes, _children(process.pid))])
                time.sleep(0.1)
        finally:
            process.terminate()
            process.wait(timeout=20)
        log.seek(0)
        return peak // MEBIBYTE, log.read().decode(errors="replace")


def _children(pid: int) -> list[int]:
    with contextlib.suppress(OSError):
        threads = Path(f"/proc/{pid}/task").glob("*/children")
        return [int(child) for thread in threads for child in thread.read_text(encoding="ascii").split()]
    return []


def _peak_bytes(pid: int) -> int:
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    return 0
