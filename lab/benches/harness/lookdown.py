"""The Lookdown server."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path

from .frames import calibration, frame
from .places import LOOKDOWN, SAMPLES
from .processes import Server, free_ports, running

MODEL, CROP_MODEL = "nanodet_g_views_416", "nanodet_g_fisheye_416"
"""The models of the views and the crops on a CPU."""

ROOMY = {
    "LIMITS__MAX_FRAMES_IN_FLIGHT": "512",
    "LIMITS__MAX_UPLOAD_BYTES": "2147483648",
    "SERVER__REQUEST_TIMEOUT_MILLIS": "600000",
}
"""Settings under which no request of a closed loop is refused: the client would only retry."""


@contextlib.contextmanager
def lookdown(settings: dict[str, str] | None = None, calibrations: Path = SAMPLES / "calibrations") -> Iterator[Server]:
    """The release binary, started as `make serve` does, with the samples' calibrations."""
    (port,) = free_ports(1)
    wanted = {"SERVER__LISTEN": f"127.0.0.1:{port}", "CALIBRATIONS__PATH": str(calibrations), "LOG__FILTER": "warn"}
    wanted |= settings or {}
    environment = {f"LOOKDOWN__{name}": value for name, value in wanted.items()}
    with running("lookdown", [str(LOOKDOWN), "serve"], port, "/readyz", environment) as server:
        # The server is ready when the model of the default profile is loaded; others may still be loading.
        camera = next(calibrations.glob("*.json")).stem
        server.wait_for(f"/calibrations/{camera}/views?profile=paper")
        yield server


def detect(profile: str, camera: str = "office") -> str:
    """Path and query of a detection."""
    return f"/detect?calibration={camera}&profile={profile}"


def report(server: Server, path: str, image: Path) -> dict:
    """The report on a frame."""
    return json.loads(server.post(path, image.read_bytes()))


def view_plan(server: Server, profile: str) -> dict:
    """The view plan of a frame of the office."""
    return json.loads(server.get(f"/calibrations/{calibration().stem}/views?profile={profile}"))


def runs_of(server: Server, profile: str) -> tuple[int, int]:
    """The runs for views and for crops of the frame of the office; this builds the remap tables of the camera."""
    views = report(server, detect(profile), frame())["views"]
    searched = len(view_plan(server, profile)["views"]) - sum(
        count for name, count in views.items() if name != "inferred"
    )
    return searched, views["inferred"] - searched
