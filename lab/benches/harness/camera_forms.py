"""The two forms in which Lookdown follows cameras: `lookdown run`, or `serve` with `watch` and `count`."""

import contextlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from harness.processes import Server, free_ports, running


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
