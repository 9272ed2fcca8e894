"""Measures the cores that straight live views of a camera take, beyond decoding, beside those of ffmpeg's `v360`.

`views_cost.py [--seconds N] [--rounds N] [--binary FILE]`, after `packaging/scripts/setup.py runtime model`, a build, and
the installation of what `camera_cost.py` needs. The stream is the clip of `tests/real/walks` enlarged to 1680² pixels,
with 10 frames per second. Each round has five windows:

* `run`: `lookdown run` that reads all frames, because one view of 64 × 64 pixels is watched;
* `views`: the same with two more views of 960 × 720 pixels, each with a viewer;
* `decode`: ffmpeg decodes the stream;
* `encode`: ffmpeg also scales the whole frame to two images of 960 × 720 pixels and writes both as MJPEG;
* `v360`: ffmpeg writes the same two views as `views`, with its filter `v360`.

Prints JSON: the cores of each window, and then the medians of the differences: of `views` and `run`, and of `v360` and
`decode`, with their ratio.
"""

import argparse
import contextlib
import http.client
import json
import statistics
import subprocess
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

from camera_cost import cpu_of, frames_of, installation, one_process, reports_of, rtsp_server
from harness.places import LOOKDOWN
from harness.processes import Server
from harness.usage import usage_of

SIDE = 1680
CAMERA = "walks0"
WARM_UP_SECONDS = 10.0
SMALL = {"width": 64, "height": 64}
VIEWS = {
    "east": {"azimuth_deg": 0, "tilt_deg": 50, "field_of_view_deg": 90},
    "south": {"azimuth_deg": 90, "tilt_deg": 50, "field_of_view_deg": 90},
}
"""Views of 960 × 720 pixels, the default size."""
VERTICAL_DEG = 73.74
"""The vertical field of view of 4:3 at a horizontal one of 90°."""
V360 = "v360=input=fisheye:ih_fov=180:iv_fov=180:output=flat:h_fov=90:v_fov={v}:w=960:h=720:yaw={yaw}:pitch={pitch}"


def enlarged(folder: Path) -> Path:
    """The frames of the clip in the side of the measurement."""
    large = folder / "large"
    large.mkdir()
    frames = ["-start_number", "0", "-i", frames_of("walkers", folder / "walkers") / "%d.jpg"]
    scaled = ["-vf", f"scale={SIDE}:{SIDE}", "-q:v", "2", "-start_number", "0", large / "%d.jpg"]
    subprocess.run(["ffmpeg", "-v", "error", *frames, *scaled], check=True)
    return large


def watch(server: Server, view: str, ended: threading.Event, counts: dict[str, int]) -> None:
    """Reads the stream of a view, and counts its images."""
    connection = http.client.HTTPConnection(server.address, timeout=60)
    connection.request("GET", f"/cameras/{CAMERA}/views/{view}.mjpg")
    with contextlib.closing(connection), connection.getresponse() as stream:
        while not ended.is_set() and (line := stream.readline()):
            if line.lower().startswith(b"content-length:"):
                stream.read(2 + int(line.split(b":")[1]))
                counts[view] = counts.get(view, 0) + 1


def of_run(options: argparse.Namespace, url: str, views: dict[str, dict]) -> dict:
    """Cores of `lookdown run` and of its ffmpeg, with viewers of these views."""
    ended, counts = threading.Event(), {}
    with (
        tempfile.TemporaryDirectory() as folder,
        one_process(installation(options, options.binary, Path(folder), url)) as (server,),
    ):
        for name, view in views.items():
            address = f"http://{server.address}/cameras/{CAMERA}/views/{name}"
            urllib.request.urlopen(urllib.request.Request(address, json.dumps(view).encode(), method="PUT")).close()
        while not reports_of(server):
            time.sleep(0.2)
        viewers = [threading.Thread(target=watch, args=(server, view, ended, counts), daemon=True) for view in views]
        for viewer in viewers:
            viewer.start()
        time.sleep(WARM_UP_SECONDS)
        before, frames, began = cpu_of([server]), dict(counts), time.monotonic()
        time.sleep(options.seconds)
        passed = time.monotonic() - began
        spent = cpu_of([server]) - before
        ended.set()
        rates = {name: round((count - frames.get(name, 0)) / passed, 2) for name, count in counts.items()}
    cores = {"run": 0.0, "ffmpeg": 0.0}
    for (process, _), seconds in spent.items():
        cores[process] = cores.get(process, 0.0) + seconds / passed
    return {name: round(value, 3) for name, value in cores.items()} | {"images_per_second": rates}


def of_ffmpeg(options: argparse.Namespace, url: str, outputs: list[str]) -> dict:
    """Cores of ffmpeg that reads the stream and writes these outputs."""
    command = ["ffmpeg", "-v", "error", "-rtsp_transport", "tcp", "-i", url, *outputs]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL)
    try:
        time.sleep(WARM_UP_SECONDS)
        before, began = usage_of(process.pid), time.monotonic()
        time.sleep(options.seconds)
        spent = usage_of(process.pid).cpu_seconds - before.cpu_seconds
        return {"ffmpeg": round(spent / (time.monotonic() - began), 3)}
    finally:
        process.kill()
        process.wait()


def two(first: str, second: str) -> list[str]:
    """The arguments of ffmpeg for two MJPEG streams of the results of two filters."""
    graph = f"[0:v]split[a][b];[a]{first}[x];[b]{second}[y]"
    coded = ["-c:v", "mjpeg", "-q:v", "5", "-f", "mjpeg", "/dev/null"]
    return ["-filter_complex", graph, "-y", "-map", "[x]", *coded, "-map", "[y]", *coded]


def main(options: argparse.Namespace) -> None:
    """Prints the windows of all rounds, and the medians."""
    # The first view looks to the right of the frame, and the second one down.
    east = V360.format(v=VERTICAL_DEG, yaw=50, pitch=0)
    south = V360.format(v=VERTICAL_DEG, yaw=0, pitch=-50)
    scale = "scale=960:720:flags=bilinear"
    rows = []
    with tempfile.TemporaryDirectory() as name, rtsp_server(enlarged(Path(name))) as url:
        for number in range(options.rounds):
            row = {
                "run": of_run(options, url, {"small": SMALL}),
                "views": of_run(options, url, {"small": SMALL} | VIEWS),
                "decode": of_ffmpeg(options, url, ["-f", "null", "-"]),
                "encode": of_ffmpeg(options, url, two(scale, scale)),
                "v360": of_ffmpeg(options, url, two(east, south)),
            }
            print(json.dumps({"round": number} | row), flush=True)
            rows.append(row)
    views = statistics.median(row["views"]["run"] - row["run"]["run"] for row in rows)
    v360 = statistics.median(row["v360"]["ffmpeg"] - row["decode"]["ffmpeg"] for row in rows)
    print(json.dumps({"views": round(views, 3), "v360": round(v360, 3), "ratio": round(v360 / max(views, 1e-9), 1)}))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=30.0, help="length of a window")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--binary", type=Path, default=LOOKDOWN)
    parser.set_defaults(cameras=1, form="run", follow=True, hwaccel=None)
    main(parser.parse_args())
