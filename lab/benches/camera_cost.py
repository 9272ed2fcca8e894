"""Measures the CPU time and the memory of cameras from RTSP to counts, for five walkers and for an empty room.

`camera_cost.py [--seconds N] [--rounds N] [--cameras N] [--form run|three] [--scene walkers|empty] [BINARY...]`, after
`packaging/scripts/setup.py runtime model`, `cargo build --release`, and the installation of `ffmpeg`, `gir1.2-gst-rtsp-server-1.0`
and GStreamer's plugins; with `--file`, `ffmpeg` alone. The stream has 960² pixels and 10 frames per second. Five of them
are processed with `fast`. `taskset -c 0,1 camera_cost.py --file` measures on two of the cores.
"Walkers" is the rendered clip of `tests/real/walks`. "Empty" is the median of its frames with new noise in each
frame, so that the H.264 encoder makes noise of its own. Several binaries run in alternating windows.

Prints JSON: one line per window, with the CPU time of each process and of each group of threads in milliseconds per
report, cores for the wanted rate, and the proportional set size (PSS) at the end.
"""

import argparse
import contextlib
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from harness.places import LOOKDOWN, ROOT
from harness.processes import BenchError, Server, free_ports, running

CLIP = ROOT / "tests" / "real" / "walks"
RTSP_SERVER = ROOT / "tests" / "real" / "rtsp_server.py"
SCENES = ("walkers", "empty")
STREAM_RATE = 10
WANTED_RATE = 5
"""Frames per second that are processed."""
EMPTY_FRAMES = 50
FILE_SECONDS = 150
"""Length of a file: more than start, warm-up and window."""
WARM_UP_SECONDS = 12.0
"""Longer than detections of views without motion are kept, 10 s."""
TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
PROC = Path("/proc")


@dataclass
class Installation:
    """What both forms are started with."""

    binary: Path
    folder: Path
    """The place of the settings, the counts and the state."""
    calibrations: Path
    camera_defaults: dict
    cameras: list[dict]
    """The keys of each camera."""

    def settings(self, **more: dict) -> str:
        """Writes the settings of all parts, with more keys by table."""
        tables = {
            "calibrations": {"path": str(self.calibrations)},
            "shutdown": {"grace_millis": 0},
            "counts": {"path": str(self.folder / "counts.sqlite")} | more.pop("counts", {}),
            "state": {"path": str(self.folder)},
            "camera_defaults": self.camera_defaults,
        } | more
        lines = [line for table, keys in tables.items() for line in (f"[{table}]", *_lines(keys))]
        lines += [line for keys in self.cameras for line in ("[[cameras]]", *_lines(keys))]
        file = self.folder / "lookdown.toml"
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return str(file)


@contextlib.contextmanager
def one_process(installation: Installation) -> Iterator[list[Server]]:
    """Runs `lookdown run`."""
    (port,) = free_ports(1)
    file = installation.settings(server={"listen": f"127.0.0.1:{port}"})
    with running("one", [str(installation.binary), "run", file], port, "/readyz", {}) as server:
        yield [server]


@contextlib.contextmanager
def three_processes(installation: Installation) -> Iterator[list[Server]]:
    """Runs `lookdown serve`, `watch` and `count`. The first one has the reports."""
    port, watch_port, count_port = free_ports(3)
    binary = str(installation.binary)
    file = installation.settings(
        server={"listen": f"127.0.0.1:{port}"},
        upstream={"url": f"http://127.0.0.1:{port}"},
        counts={"listen": f"127.0.0.1:{count_port}"},
    )
    watching = [binary, "watch", file, "--metrics-listen", f"127.0.0.1:{watch_port}"]
    with (
        running("serve", [binary, "serve", "--config", file], port, "/readyz", {}) as server,
        running("count", [binary, "count", file], count_port, "/livez", {}) as count,
        running("watch", watching, watch_port, "/metrics", {}) as watch,
    ):
        yield [server, watch, count]


def metric(server: Server, start: str) -> dict[str, float]:
    """The values of the metrics whose lines begin like this."""
    lines = server.get("/metrics").decode().splitlines()
    found = (line.rpartition(" ") for line in lines if line.startswith(start))
    return {name: float(value) for name, _, value in found}


def reports_of(server: Server) -> float:
    """The number of frames that were detected."""
    requests = metric(server, "lookdown_http_requests_total{")
    return sum(count for name, count in requests.items() if "/detect" in name)


def pss_bytes(pid: int) -> int:
    """The proportional set size of a process."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
    (pss,) = [line.split()[1] for line in lines if line.startswith("Pss:")]
    return 1024 * int(pss)


def _lines(keys: dict) -> list[str]:
    return [f"{key} = {json.dumps(value)}" for key, value in keys.items()]


def main(options: argparse.Namespace) -> None:
    """Prints the windows of all rounds."""
    with tempfile.TemporaryDirectory() as name:
        scenes = {scene: frames_of(scene, Path(name) / scene) for scene in options.scenes or SCENES}
        with contextlib.ExitStack() as stack:
            serve = video_file if options.file else rtsp_server
            urls = {scene: stack.enter_context(serve(folder)) for scene, folder in scenes.items()}
            for number in range(options.rounds):
                for scene, url in urls.items():
                    for binary in options.binaries:
                        with tempfile.TemporaryDirectory() as folder:
                            window = measured(options, binary, Path(folder), url)
                        told = {"round": number, "scene": scene, "form": options.form, "binary": str(binary)}
                        print(json.dumps(told | window), flush=True)


def frames_of(scene: str, folder: Path) -> Path:
    """Writes the frames of a scene as `0.jpg`, `1.jpg` …"""
    folder.mkdir()
    ffmpeg = ["ffmpeg", "-v", "error"]
    images = ["-q:v", "2", "-start_number", "0", folder / "%d.jpg"]
    clip = ["-i", CLIP / "walks.mp4"]
    if scene == "walkers":
        # At the pace of the clip, which has fewer frames per second.
        subprocess.run([*ffmpeg, *clip, "-r", str(STREAM_RATE), *images], check=True)
        return folder
    empty = folder / "empty.png"
    subprocess.run([*ffmpeg, *clip, "-vf", "tmedian=radius=85", "-frames:v", "1", empty], check=True)
    # Uniform noise of a standard deviation of two levels.
    noise = ["-vf", "format=yuv420p,noise=c0s=7:c0f=t+u", "-frames:v", str(EMPTY_FRAMES)]
    subprocess.run([*ffmpeg, "-loop", "1", "-i", empty, *noise, *images], check=True)
    return folder


@contextlib.contextmanager
def video_file(folder: Path) -> Iterator[str]:
    """Writes the frames of a folder as H.264 to a file that lasts for a window, with the settings of the RTSP server."""
    path = folder / "stream.mp4"
    frames = ["-stream_loop", "-1", "-framerate", str(STREAM_RATE), "-i", folder / "%d.jpg", "-t", str(FILE_SECONDS)]
    coded = ["-c:v", "libx264", "-preset", "ultrafast", "-tune", "zerolatency", "-g", str(STREAM_RATE)]
    subprocess.run(["ffmpeg", "-v", "error", *frames, *coded, "-b:v", "2M", "-pix_fmt", "yuv420p", path], check=True)
    yield str(path)


@contextlib.contextmanager
def rtsp_server(folder: Path) -> Iterator[str]:
    """Serves the frames of a folder as H.264."""
    (port,) = free_ports(1)
    # GStreamer is only available to Debian's Python.
    command = ["/usr/bin/python3", RTSP_SERVER, str(port), folder, str(STREAM_RATE)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield f"rtsp://127.0.0.1:{port}/stream"
        finally:
            process.kill()


def measured(options: argparse.Namespace, binary: Path, folder: Path, url: str) -> dict:
    """A window with this binary."""
    form = one_process if options.form == "run" else three_processes
    with form(installation(options, binary, folder, url)) as servers:
        deadline = time.monotonic() + 60
        while reports_of(servers[0]) < options.cameras:
            if time.monotonic() > deadline:
                raise BenchError("no camera has a report after 60 s: are ffmpeg and GStreamer installed?")
            time.sleep(0.2)
        time.sleep(WARM_UP_SECONDS)
        reports, searches = reports_of(servers[0]), searches_of(servers[0])
        cpu, began = cpu_of(servers), time.monotonic()
        time.sleep(options.seconds)
        passed = time.monotonic() - began
        reports, cpu = reports_of(servers[0]) - reports, cpu_of(servers) - cpu
        searches = {name: count - searches.get(name, 0) for name, count in searches_of(servers[0]).items()}
        rate = reports / passed / options.cameras
        processes = Counter()
        for (process, _), seconds in cpu.items():
            processes[process] += seconds
        return {
            "cameras": options.cameras,
            "reports_per_second": round(rate, 2),
            "cpu_ms_per_report": round(1000 * cpu.total() / reports, 1),
            "cores_per_camera": round(cpu.total() / reports * WANTED_RATE, 3),
            "processes_ms": {name: round(1000 * spent / reports, 2) for name, spent in processes.most_common()},
            "threads_ms": {
                f"{process}: {thread}": round(1000 * spent / reports, 2)
                for (process, thread), spent in cpu.most_common(14)
                if spent > 0
            },
            "searches": {name: round(count / reports, 3) for name, count in searches.items()},
            "pss_mib": [round(pss_bytes(server.pid) / 2**20, 1) for server in servers],
            "pss_of_ffmpeg_mib": round(sum(map(pss_bytes, children(servers))) / 2**20, 1),
        }


def searches_of(server: Server) -> dict[str, float]:
    """The number of frames by the way in which their persons were found, and the number of inferred views."""
    found = metric(server, "lookdown_frame_searches_total{") | metric(server, "lookdown_views_total")
    return {re.sub(r'.*"(.*)".*', r"\1", name).removeprefix("lookdown_"): count for name, count in found.items()}


def cpu_of(servers: list[Server]) -> Counter[tuple[str, str]]:
    """The CPU time in seconds by process and by group of threads."""
    spent = Counter()
    for pid in [server.pid for server in servers] + children(servers):
        process = command_of(pid)
        for task in (PROC / str(pid) / "task").iterdir():
            with contextlib.suppress(OSError):
                head, _, tail = (task / "stat").read_text(encoding="utf-8").rpartition(")")
                thread = re.sub(r"[-_ ]*\d+$", "", head.partition("(")[2])
                fields = tail.split()
                spent[process, thread] += (int(fields[11]) + int(fields[12])) / TICKS_PER_SECOND
    return spent


def command_of(pid: int) -> str:
    """The name of a process: `ffmpeg`, `run`, `serve`, `watch` or `count`."""
    words = (PROC / str(pid) / "cmdline").read_bytes().decode().split("\0")
    return words[1] if words[0].rpartition("/")[2].startswith("lookdown") else words[0].rpartition("/")[2]


def children(servers: list[Server]) -> list[int]:
    """The child processes of these servers."""
    tasks = [task for server in servers for task in (PROC / str(server.pid) / "task").iterdir()]
    return [int(child) for task in tasks for child in (task / "children").read_text(encoding="ascii").split()]


def installation(options: argparse.Namespace, binary: Path, folder: Path, url: str) -> Installation:
    """The cameras of a window, all of the same stream."""
    calibrations = folder / "calibrations"
    calibrations.mkdir()
    shutil.copy(CLIP / "calibration.json", calibrations / "walks.json")
    every = f"{1000 // WANTED_RATE}ms"
    return Installation(
        binary=binary.resolve(),
        folder=folder,
        calibrations=calibrations,
        camera_defaults={"profile": "fast", "every": every, "calibration": "walks", "follow": options.follow}
        | ({"hwaccel": options.hwaccel} if options.hwaccel else {}),
        cameras=[
            {
                "name": f"walks{number}",
                "url": url,
                "parameters.score_threshold": 0.06,
            }
            for number in range(options.cameras)
        ],
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("binaries", nargs="*", type=Path, default=[LOOKDOWN], metavar="BINARY")
    parser.add_argument("--seconds", type=float, default=30.0, help="length of a window")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--cameras", type=int, default=1, help="cameras of a window, all of the same stream")
    parser.add_argument("--form", choices=("run", "three"), default="run")
    parser.add_argument("--every-frame", dest="follow", action="store_false", help="search every frame")
    parser.add_argument("--file", action="store_true", help="play a video file instead of an RTSP stream")
    parser.add_argument("--hwaccel", help="decode in hardware: a method that `ffmpeg -hwaccels` lists")
    parser.add_argument("--scene", dest="scenes", action="append", choices=SCENES, help="both if none is given")
    main(parser.parse_args())
