"""Compares `lookdown run` with `serve`, `watch` and `count` of the same cameras: CPU time and memory.

`one_process.py [SECONDS] [ROUNDS]`, after `scripts/setup.py runtime model` and `cargo build --release`. Four MJPEG
cameras of `samples/office.jpg`, `fast`, at 1 and at 5 frames per second. Both forms run in alternating windows, so that
other load on the machine affects both. CPU time is per report, because a busy machine skips frames. Memory is the
proportional set size (PSS) of the processes at the end of a window, so that pages of the shared program count once.
Prints JSON: one line per window.
"""

import contextlib
import http.server
import json
import os
import sys
import tempfile
import threading
import time
from pathlib import Path

from harness.camera_forms import Installation, one_process, pss_bytes, reports_of, three_processes
from harness.places import LOOKDOWN, SAMPLES
from harness.processes import Server

CAMERAS = ("north", "east", "south", "west")
RATES = (1, 5)
WARM_UP_SECONDS = 10.0
TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
FRAME = (SAMPLES / "office.jpg").read_bytes()


class Camera(http.server.BaseHTTPRequestHandler):
    """An MJPEG stream of 10 frames per second."""

    def log_message(self, *_):
        """Logs nothing."""

    def do_GET(self):
        """Sends frames until the client leaves."""
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(FRAME)}\r\n\r\n".encode()
        with contextlib.suppress(OSError):
            while True:
                self.wfile.write(head + FRAME + b"\r\n")
                time.sleep(0.1)


def main(seconds: float, rounds: int) -> None:
    """Prints the windows of all rounds."""
    source = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Camera)
    source.daemon_threads = True
    threading.Thread(target=source.serve_forever, daemon=True).start()
    for number in range(rounds):
        for rate in RATES:
            for form in (one_process, three_processes):
                with tempfile.TemporaryDirectory() as folder:
                    cameras = installation(Path(folder), source.server_port, rate)
                    with form(cameras) as servers:
                        window = measure(servers, seconds)
                print(json.dumps({"round": number, "form": form.__name__, "rate": rate} | window), flush=True)


def measure(servers: list[Server], seconds: float) -> dict:
    """CPU time per report and memory of these processes. The first one has the reports."""
    time.sleep(WARM_UP_SECONDS)
    reports, cpu, began = reports_of(servers[0]), cpu_seconds(servers), time.monotonic()
    time.sleep(seconds)
    passed = time.monotonic() - began
    reports, cpu = reports_of(servers[0]) - reports, cpu_seconds(servers) - cpu
    return {
        "reports_per_second": round(reports / passed, 2),
        "cpu_ms_per_report": round(1000 * cpu / reports, 1),
        "pss_mib": [round(pss_bytes(server.pid) / 2**20, 1) for server in servers],
    }


def cpu_seconds(servers: list[Server]) -> float:
    """The CPU time of the processes."""
    fields = [
        Path(f"/proc/{server.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split() for server in servers
    ]
    return sum(int(field[11]) + int(field[12]) for field in fields) / TICKS_PER_SECOND


def installation(folder: Path, source: int, rate: int) -> Installation:
    """The four cameras of a window."""
    return Installation(
        binary=LOOKDOWN,
        folder=folder,
        calibrations=SAMPLES / "calibrations",
        camera_defaults={"profile": "fast", "every": f"{1000 // rate}ms", "calibration": "office"},
        cameras=[{"name": name, "url": f"http://127.0.0.1:{source}/{name}"} for name in CAMERAS],
    )


if __name__ == "__main__":
    given = [float(argument) for argument in sys.argv[1:]]
    main(given[0] if given else 60.0, int(given[1]) if len(given) > 1 else 3)
