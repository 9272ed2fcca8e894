"""HAProxy with the recipe of the documentation: the frames of a camera reach one replica, and its motion cache."""

import collections
import contextlib
import json
import os
import random
import signal
import subprocess
import tempfile
import threading
import time
import unittest
import urllib.parse
import urllib.request
from pathlib import Path

from chain import RECIPE, REPLICAS, Chain, chain
from crowd import Crowd, crowd
from state import wait_until
from support.lookdown import TINY
from support.places import OFFICE
from test_replicas import HEADERS, office, put_everywhere

CAMERAS = tuple(f"camera-{number}" for number in range(12))
DETECT = "/detect?calibration=office&profile=fast"
ENOUGH = 20
"""Answers of each camera after which a change has been under load long enough."""
PERSON = (344, 128, 74, 112)
"""The part of the sample with a person: left, top, width and height in pixels."""
PROFILE = "balanced"
MOTION_CAMERAS = CAMERAS[:8]
FRAMES = 40
"""Frames of each camera, one per second."""
JITTER_SECONDS = 0.05
MOST_RUNS = 0.8
"""Maximum network runs with hashing relative to `leastconn`."""


def post(chain: Chain, path: str, frame: bytes) -> tuple[str, dict]:
    """The replica that answered, and the report."""
    request = urllib.request.Request(f"http://{chain.front.address}{path}", frame, HEADERS)
    with urllib.request.urlopen(request, timeout=60) as answer:
        return answer.headers["X-Replica"], json.loads(answer.read())


class Load:
    """Cameras that send frames continuously."""

    def __init__(self, cameras: dict[str, Crowd]):
        self.cameras = cameras

    def replicas(self) -> dict[str, set[str]]:
        """The replicas that answer each camera from now on."""
        before = {name: camera.replicas.copy() for name, camera in self.cameras.items()}
        for name, camera in self.cameras.items():
            enough = before[name].total() + ENOUGH
            wait_until(
                lambda camera=camera, enough=enough: camera.replicas.total() >= enough, f"{name} is answered", 60
            )
        return {
            name: {replica for replica, count in (camera.replicas - before[name]).items() if count and replica}
            for name, camera in self.cameras.items()
        }

    @property
    def statuses(self) -> collections.Counter[int]:
        """The statuses of all answers."""
        return sum((camera.statuses for camera in self.cameras.values()), collections.Counter())

    @property
    def lost(self) -> int:
        """The number of requests without an answer from a replica."""
        return sum(camera.lost for camera in self.cameras.values())


@unittest.skipIf(os.geteuid(), "only root can make hosts")
class Hashing(unittest.TestCase):
    """Tests with a network that takes no time."""

    chain: Chain

    @classmethod
    def setUpClass(cls):
        cls.chain = cls.enterClassContext(chain(TINY, front=RECIPE.read_text(encoding="utf-8")))
        put_everywhere(cls.chain.replicas, office())

    def test_a_camera_is_named_by_camera_or_else_calibration(self):
        frame = OFFICE.read_bytes()
        for names in (["camera=hall%201", "camera=hall+1"], ["calibration=office&camera=yard", "camera=yard"]):
            paths = [f"/detect?profile=fast&{name}" for name in names]
            paths = [path if "calibration" in path else f"{path}&calibration=office" for path in paths]
            self.assertEqual(len({post(self.chain, path, frame)[0] for path in paths * 3}), 1)
        self.assertEqual(len({post(self.chain, DETECT, frame)[0] for _ in range(6)}), 1)

    def test_only_the_cameras_of_a_killed_replica_move(self):
        with self._load() as load:
            home = self._homes(load)
            self.assertEqual(set(home.values()), set(REPLICAS), "every replica has cameras")
            print(f"cameras of each replica: {dict(collections.Counter(home.values()))}", flush=True)
            gone = self.chain.kill("r2")
            self.chain.wait_until("r2", "DOWN")
            moved = self._homes(load)
            self.assertEqual({name for name in home if moved[name] != home[name]}, self._cameras_of("r2", home))
            self.assertNotIn("r2", moved.values())
            self.chain.start("r2")
            self.chain.wait_until("r2", "UP")
            self.assertEqual(self._homes(load), home)
        print(f"killed: {load.statuses.total()} requests, {load.lost} lost, {dict(load.statuses)}", flush=True)
        self.assertEqual(set(load.statuses) - {0, 502, 503, 504}, {200}, load.statuses)
        for name, camera in load.cameras.items():
            late = [start - gone for start in camera.lost_starts if start >= gone or home[name] != "r2"]
            self.assertEqual(late, [], f"{name} of {home[name]}: {camera.statuses}")

    def test_stopping_replicas_in_turn_loses_no_requests(self):
        with self._load() as load:
            home = self._homes(load)
            for name in REPLICAS:
                server = self.chain.replicas[name]
                server.process.send_signal(signal.SIGTERM)
                self.assertEqual(server.process.wait(timeout=30), 0)
                moved = self._homes(load)
                changed = {camera for camera in home if moved[camera] != home[camera]}
                self.assertEqual(changed, self._cameras_of(name, home))
                self.chain.start(name)
                self.chain.wait_until(name, "UP")
            self.assertEqual(self._homes(load), home)
        print(f"stopped in turns: {load.statuses.total()} requests, {load.lost} lost", flush=True)
        self.assertEqual(set(load.statuses), {200}, load.statuses)

    @contextlib.contextmanager
    def _load(self):
        with contextlib.ExitStack() as stack:
            address, frame = self.chain.front.address, OFFICE.read_bytes()
            paths = {name: f"{DETECT}&camera={urllib.parse.quote(name)}" for name in CAMERAS}
            yield Load({name: stack.enter_context(crowd(address, paths[name], frame, HEADERS, 1)) for name in CAMERAS})

    def _homes(self, load: Load) -> dict[str, str]:
        """The one replica that answers each camera from now on."""
        # A request that was in flight before may still be answered by another.
        load.replicas()
        found = load.replicas()
        self.assertEqual({len(replicas) for replicas in found.values()}, {1}, found)
        return {name: replica for name, (replica,) in found.items()}

    @staticmethod
    def _cameras_of(replica: str, home: dict[str, str]) -> set[str]:
        return {name for name, where in home.items() if where == replica}


@unittest.skipIf(os.geteuid(), "only root can make hosts")
class Motion(unittest.TestCase):
    """Tests at the rate of real cameras. The network takes no time: only its runs are counted."""

    def test_hashing_saves_network_runs_of_motion(self):
        hashing = RECIPE.read_text(encoding="utf-8")
        leastconn = "".join(line for line in hashing.splitlines(keepends=True) if "use_backend cameras" not in line)
        inferred = {}
        with tempfile.TemporaryDirectory() as folder:
            frames = walk(Path(folder))
        for name, front in (("leastconn", leastconn), ("hashing", hashing)):
            with chain(TINY, front=front) as replicas:
                put_everywhere(replicas.replicas, office())
                began = time.monotonic()
                views = send_at_their_rate(replicas, frames)
                took = time.monotonic() - began
            inferred[name] = views["inferred"]
            told = f"{len(MOTION_CAMERAS)} cameras, {FRAMES} frames each in {took:.0f} s, views {dict(views)}"
            print(f"{name}, {PROFILE}: {told}", flush=True)
        self.assertLess(inferred["hashing"], MOST_RUNS * inferred["leastconn"])


def walk(folder: Path) -> list[bytes]:
    """Frames in which one person walks and everything else stands still."""
    left, top, width, height = PERSON
    crop = f"[0]crop={width}:{height}:{left}:{top}[person];[0][person]overlay=x=150+6*n:y=520:shortest=0"
    command = ["ffmpeg", "-v", "error", "-loop", "1", "-i", str(OFFICE), "-filter_complex", crop]
    subprocess.run([*command, "-frames:v", str(FRAMES), "-q:v", "2", str(folder / "%03d.jpg")], check=True)
    return [file.read_bytes() for file in sorted(folder.glob("*.jpg"))]


def send_at_their_rate(replicas: Chain, frames: list[bytes]) -> collections.Counter[str]:
    """Sends a frame of each camera per second, each at its own phase. Returns the numbers of views by outcome."""
    views: collections.Counter[str] = collections.Counter()
    began, lock = time.monotonic(), threading.Lock()

    def send(number: int, camera: str) -> None:
        chance = random.Random(number)
        phase = chance.random()
        path = f"/detect?calibration=office&profile={PROFILE}&motion=true&camera={camera}"
        for second, frame in enumerate(frames):
            due = began + second + phase + chance.uniform(-JITTER_SECONDS, JITTER_SECONDS)
            time.sleep(max(0.0, due - time.monotonic()))
            report = post(replicas, path, frame)[1]
            with lock:
                views.update({name: report["views"][name] for name in ("inferred", "unchanged")})

    threads = [threading.Thread(target=send, args=each) for each in enumerate(MOTION_CAMERAS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return views
