"""Two servers that share a Redis: each answers for any camera, and detection does not need Redis."""

import contextlib
import http.client
import json
import random
import shutil
import subprocess
import tempfile
import threading
import time
import unittest
import unittest.mock
from collections.abc import Iterator, Sequence
from pathlib import Path

from harness.places import LOOKDOWN, ROOT
from harness.processes import Server, free_ports, running
from redis_server import RedisServer
from state import PATIENCE_SECONDS, metric, wait_until
from support.exchange import Answer, ask
from support.places import OFFICE, SAMPLES, TINY_MODEL

FRAME = OFFICE.read_bytes()
SCRIPTS = ROOT / "src" / "results" / "redis"
RECORD = "".join((SCRIPTS / name).read_text(encoding="utf-8") for name in ("forget.lua", "record.lua"))
"""The script that stores a report."""
MOST_IMAGES = 2


@contextlib.contextmanager
def replica(
    name: str, url: str, host: str = "127.0.0.1", inside: Sequence[str] = (), **settings: str
) -> Iterator[Server]:
    """A server of that name with that Redis.

    `host` is its address, and the command `inside` starts a program on the host with that address.
    """
    (port,) = free_ports(1)
    wanted = {
        "SERVER__LISTEN": f"{host}:{port}",
        "SHUTDOWN__GRACE_MILLIS": "0",
        "CALIBRATIONS__PATH": str(SAMPLES / "calibrations"),
        "MODEL__PATH": str(TINY_MODEL),
        "RESULTS__URL": url,
        **settings,
    }
    environment = {f"LOOKDOWN__{key}": value for key, value in wanted.items()}
    with running(name, [*inside, str(LOOKDOWN), "serve"], port, "/readyz", environment, host=host) as server:
        wait_until(
            lambda: "store_problem" not in get(server, "/readyz").json()["results"] or "unreachable" in name,
            "Redis is connected",
        )
        yield server


def log_of(server: Server) -> str:
    """What a replica has logged so far."""
    return server.log.read_text(encoding="utf-8")


def get(server: Server, path: str, **headers: str) -> Answer:
    """The answer to a GET request."""
    return ask(server.address, "GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})


def detect(server: Server, camera: str) -> Answer:
    """The answer to a frame."""
    path = f"/detect?calibration=office&profile=fast&camera={camera}"
    return ask(server.address, "POST", path, FRAME, {"Content-Type": "image/jpeg"})


class Stream:
    """Server-sent events."""

    def __init__(self, server: Server, path: str, **headers: str) -> None:
        """Listens from now on."""
        self._connection = http.client.HTTPConnection(server.address, timeout=PATIENCE_SECONDS)
        self._connection.request(
            "GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()}
        )
        self._answer = self._connection.getresponse()
        assert self._answer.status == 200, self._answer.read()

    def next(self) -> tuple[str, bytes]:
        """ID and data of the next event. Comments are skipped."""
        found = {}
        while True:
            line = self._answer.readline()
            assert line, "the stream has ended"
            name, _, value = line.rstrip(b"\n").partition(b": ")
            if name:
                found[name] = value
            elif b"data" in found:
                return found[b"id"].decode(), found[b"data"]

    def close(self) -> None:
        """Disconnects."""
        self._connection.close()


class Shared(unittest.TestCase):
    """Two servers and a Redis that works."""

    @classmethod
    def setUpClass(cls) -> None:
        """Starts one Redis and two servers for all tests."""
        cls.redis = cls.enterClassContext(RedisServer())
        cls.one = cls.enterClassContext(replica("redis-one", cls.redis.url))
        cls.other = cls.enterClassContext(replica("redis-other", cls.redis.url))

    def latest(self, server: Server, camera: str, report: bytes) -> Answer:
        """Waits until this is the latest report of a camera, and returns the answer."""
        path = f"/results/{camera}/latest"
        wait_until(lambda: get(server, path).body == report, "the report is the latest")
        return get(server, path)

    def usage(self) -> list[float]:
        """The numbers of stored cameras, reports and bytes."""
        return [metric(self.other, f"results_{name}") for name in ("cameras", "reports", "bytes")]

    def test_reports_and_ids_are_identical_on_every_server(self) -> None:
        """Latest, history, list and 304."""
        sent = [detect(server, "atrium").body for server in (self.one, self.other, self.one)]
        one, other = (self.latest(server, "atrium", sent[-1]) for server in (self.one, self.other))
        self.assertEqual(one.headers["etag"], other.headers["etag"])
        again = get(self.other, "/results/atrium/latest", If_None_Match=one.headers["etag"])
        self.assertEqual(again.status, 304)
        pages = [get(server, "/results/atrium/history").body for server in (self.one, self.other)]
        self.assertEqual(pages[0], pages[1])
        kept = [row["report"] for row in json.loads(pages[0])]
        self.assertEqual(kept, [json.loads(report) for report in sent])
        ids = [int(row["id"]) for row in json.loads(pages[0])]
        self.assertEqual(sorted(set(ids)), ids)
        self.assertLess(abs(ids[-1] / 1e6 - time.time()), 60.0)
        since = [
            get(server, f"/results/atrium/history?since={ids[0]}&limit=1").json() for server in (self.one, self.other)
        ]
        self.assertEqual(since[0], since[1])
        self.assertEqual([int(row["id"]) for row in since[0]], ids[1:2])
        rows = [
            [
                {key: row[key] for key in ("camera", "id", "received_at", "persons")}
                for row in get(server, "/results").json()
            ]
            for server in (self.one, self.other)
        ]
        self.assertEqual(rows[0], rows[1])

    def append_latest(self, answers: list[Answer], path: str, tag: str) -> None:
        answers.append(get(self.other, path, If_None_Match=tag))

    def test_deleted_cameras_are_gone_on_every_server(self) -> None:
        """Reports, and the total of their bytes."""
        before = self.usage()
        for _ in range(3):
            sent = detect(self.one, "attic").body
        self.latest(self.other, "attic", sent)
        self.assertEqual(ask(self.other.address, "DELETE", "/results/attic").status, 204)
        for server in (self.one, self.other):
            self.assertEqual(get(server, "/results/attic/latest").status, 404)
        self.assertEqual(self.usage(), before)
        self.assertEqual(ask(self.one.address, "DELETE", "/results/attic").status, 404)
        self.latest(self.other, "attic", detect(self.one, "attic").body)
        self.assertEqual(ask(self.one.address, "DELETE", "/results/attic").status, 204)

    def test_long_polls_are_answered_by_reports_of_other_servers(self) -> None:
        """Long polls, also for the first report of a camera."""
        for before in (None, "known"):
            tag = '"0"'
            if before:
                first = detect(self.one, "stairs")
                tag = self.latest(self.other, "stairs", first.body).headers["etag"]
            answers: list[Answer] = []
            path = "/results/stairs/latest?wait=10"
            waiting = threading.Thread(target=self.append_latest, args=(answers, path, tag))
            waiting.start()
            wait_until(lambda: metric(self.other, "results_listeners") >= 1.0, "a client listens")
            began = time.monotonic()
            sent = detect(self.one, "stairs")
            waiting.join(PATIENCE_SECONDS)
            self.assertEqual((answers[0].status, answers[0].body), (200, sent.body))
            self.assertLess(time.monotonic() - began, 3.0)

    def test_event_streams_can_be_resumed_on_another_server(self) -> None:
        """`Last-Event-ID`, and both kinds of streams."""
        first = detect(self.one, "yard").body
        self.latest(self.other, "yard", first)
        stream = Stream(self.one, "/results/yard/events")
        identifier, data = stream.next()
        self.assertEqual(data, first)
        sent = [detect(self.other, "yard").body, detect(self.one, "yard").body]
        self.assertEqual([stream.next()[1] for _ in sent], sent)
        stream.close()
        for path in ("/results/yard/events", "/events"):
            resumed = Stream(self.other, path, Last_Event_ID=identifier)
            self.assertEqual([resumed.next()[1] for _ in sent], sent)
            newest = detect(self.one, "yard").body
            self.assertEqual(resumed.next()[1], newest)
            resumed.close()
            sent.append(newest)

    def test_listeners_cost_redis_no_connections(self) -> None:
        """Two for each server, independent of the number of listeners."""
        streams = [Stream(self.one, f"/results/camera-{number}/events") for number in range(30)]
        clients = self.redis.ask("CLIENT", "LIST").decode().splitlines()
        # The connection of this test is one of them.
        self.assertEqual(len(clients) - 1, 4)
        for stream in streams:
            stream.close()

    def test_a_server_subscribes_only_to_cameras_with_listeners(self) -> None:
        """And ends a subscription some seconds after its last listener has left."""

        def channels() -> set[bytes]:
            return set(self.redis.ask("PUBSUB", "SHARDCHANNELS"))

        wait_until(lambda: not channels(), "no listener is left of other tests")
        streams = [Stream(self.one, "/results/a/events"), Stream(self.other, "/results/b/events")]
        streams.append(Stream(self.other, "/results/b/events"))
        self.assertEqual(channels(), {b"{lookdown}:0:camera:a", b"{lookdown}:0:camera:b"})
        self.assertEqual(self.redis.ask("PUBSUB", "SHARDNUMSUB", "{lookdown}:0:camera:b")[1], 1)
        streams.append(Stream(self.one, "/events"))
        self.assertIn(b"{lookdown}:0:all", channels())
        for stream in streams:
            stream.close()
        wait_until(lambda: not channels(), "the subscriptions have ended")

    def test_every_key_expires(self) -> None:
        """Every key has an expiry."""
        detect(self.one, "hall")
        keys = self.redis.ask("KEYS", "*")
        self.assertGreater(len(keys), 5)
        for key in keys:
            self.assertIn(self.redis.ask("TTL", key), range(80_000, 86_401), key)
            self.assertTrue(key.startswith(b"{lookdown}:"), key)

    def test_metrics_show_the_content_of_redis(self) -> None:
        """The same on both."""
        detect(self.one, "hall")
        wait_until(lambda: metric(self.one, "results_waiting") == 0.0, "all is stored")
        for name in ("results_cameras", "results_reports", "results_bytes"):
            self.assertGreaterEqual(metric(self.one, name), 1.0)
            self.assertEqual(metric(self.one, name), metric(self.other, name))
        self.assertEqual(metric(self.one, "results_store_up"), 1.0)
        self.assertEqual(metric(self.one, "results_dropped_total"), 0.0)


class Overwritten(unittest.TestCase):
    """A key of another program."""

    def test_a_key_of_another_type_hides_only_its_camera(self) -> None:
        """The reports of other cameras are listed."""
        with RedisServer() as redis, replica("redis-overwritten", redis.url) as server:
            for camera in ("hall", "lift"):
                detect(server, camera)
            wait_until(lambda: len(get(server, "/results").json()) == 2, "both reports are stored")
            key = next(key for key in redis.ask("KEYS", "*hall*") if redis.ask("TYPE", key) == "stream")
            redis.ask("SET", key, "theirs")
            answer = get(server, "/results")
            self.assertEqual(answer.status, 200, answer.body)
            self.assertEqual([row["camera"] for row in answer.json()], ["lift"])


class Away(unittest.TestCase):
    """A Redis that does not answer."""

    def test_an_outage_delays_results_but_not_answers(self) -> None:
        """Redis is killed and restarted, then halted and continued, during frames."""
        with RedisServer() as redis, replica("redis-left", redis.url) as server:
            stream = Stream(server, "/results/hall/events")
            statuses: list[int] = []
            seconds: list[float] = []
            over = threading.Event()

            def send() -> None:
                while not over.is_set():
                    began = time.monotonic()
                    statuses.append(detect(server, "hall").status)
                    seconds.append(time.monotonic() - began)

            sending = threading.Thread(target=send)
            sending.start()
            stream.next()
            usual = max(seconds[:20], default=0.0)
            for leave, come_back in ((redis.kill, redis.start), (redis.halt, redis.go_on)):
                leave()
                wait_until(lambda: get(server, "/results/hall/latest").status == 503, "the outage is detected")
                for path in ("/results", "/results/hall/latest", "/results/hall/history", "/events"):
                    answer = get(server, path)
                    self.assertEqual(answer.status, 503, path)
                    self.assertEqual(answer.headers["retry-after"], "1")
                    self.assertEqual(answer.json()["type"], "/problems/results-unreachable")
                ready = get(server, "/readyz")
                self.assertEqual(ready.status, 200)
                self.assertIn("store_problem", ready.json()["results"])
                self.assertEqual(metric(server, "results_store_up"), 0.0)
                wait_until(lambda: metric(server, "results_waiting") > 0.0, "reports wait for Redis")
                come_back()
                wait_until(lambda: get(server, "/results/hall/latest").status == 200, "Redis is connected again")
                self.assertEqual(metric(server, "results_store_up"), 1.0)
                wait_until(lambda: metric(server, "results_waiting") <= 1.0, "the waiting reports are stored")
                stream.next()
            over.set()
            sending.join(PATIENCE_SECONDS)
            print(f"{len(statuses)} frames, the slowest {max(seconds):.3f} s (before {usual:.3f} s)", end=" ... ")
            self.assertEqual(set(statuses), {200})
            self.assertLess(max(seconds), 2.0)
            # Reports of the outage are stored exactly once.
            wait_until(lambda: metric(server, "results_waiting") == 0.0, "all is stored")
            stored = [row["report"]["request_id"] for row in get(server, "/results/hall/history").json()]
            self.assertEqual(len(set(stored)), len(stored))
            stream.close()
            told = log_of(server)
        self.assertEqual(told.count("does not answer"), 2, told)
        self.assertEqual(told.count("answers again"), 2, told)

    def test_a_server_starts_without_redis_and_connects_later(self) -> None:
        """Reports wait for it, within limits."""
        redis = RedisServer()
        with replica("redis-unreachable", redis.url) as server:
            sent = detect(server, "hall")
            self.assertEqual(sent.status, 200)
            self.assertEqual(get(server, "/results").status, 503)
            with redis:
                wait_until(lambda: get(server, "/results/hall/latest").body == sent.body, "the report is the latest")
                told = log_of(server)
        self.assertEqual((told.count("does not answer"), told.count("answers again")), (1, 1), told)

    def test_the_last_reports_are_stored_before_the_server_ends(self) -> None:
        """The shutdown waits for reports in flight."""
        with RedisServer() as redis:
            with replica("redis-ends", redis.url) as server:
                sent = [detect(server, "hall").body for _ in range(5)]
            kept = redis.ask("XRANGE", "{lookdown}:camera:hall", "-", "+")
            self.assertEqual([entry[1][5] for entry in kept], sent)


class Secrets(unittest.TestCase):
    """Passwords and TLS."""

    def test_a_password_is_used_and_never_shown(self) -> None:
        """A wrong one is reported as such. When it is corrected, everything works."""
        with RedisServer("--requirepass", "s3cret-right", password="s3cret-right") as redis:
            with replica("redis-password", redis.url) as server:
                sent = detect(server, "hall").body
                wait_until(lambda: get(server, "/results/hall/latest").body == sent, "the report is the latest")
                shown = log_of(server) + get(server, "/readyz").body.decode()
            wrong = redis.url.replace("right", "wrong")
            with replica("redis-unreachable-wrong", wrong) as server:
                wait_until(
                    lambda: "WRONGPASS" in log_of(server) or "assword" in log_of(server),
                    "the wrong password is logged",
                )
                shown += get(server, "/readyz").body.decode()
                redis.ask("CONFIG", "SET", "requirepass", "s3cret-wrong")
                redis.password = "s3cret-wrong"
                sent = detect(server, "hall").body
                wait_until(lambda: get(server, "/results/hall/latest").body == sent, "the report is the latest")
                shown += log_of(server)
        self.assertNotIn("s3cret", shown)

    @unittest.skipUnless(shutil.which("openssl"), "needs openssl")
    def test_redis_with_tls_is_supported(self) -> None:
        """With an authority that the machine trusts. An unknown one is not trusted."""
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        certificate, key = folder / "redis.pem", folder / "redis.key"
        make = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=localhost"
        make += " -addext subjectAltName=DNS:localhost -addext basicConstraints=critical,CA:FALSE"
        files = ["-keyout", str(key), "-out", str(certificate)]
        subprocess.run(["openssl", *make.split(), *files], check=True, capture_output=True)
        (port,) = free_ports(1)
        options = f"--tls-port {port} --tls-cert-file {certificate} --tls-key-file {key} --tls-auth-clients no"
        with RedisServer(*options.split()):
            url = f"rediss://localhost:{port}"
            with contextlib.ExitStack() as stack:
                stack.enter_context(_variable("SSL_CERT_FILE", str(certificate)))
                server = stack.enter_context(replica("redis-tls", url))
                sent = detect(server, "hall").body
                wait_until(lambda: get(server, "/results/hall/latest").body == sent, "the report is the latest")
            with replica("redis-unreachable-untrusted", url) as server:
                self.assertEqual(get(server, "/results").status, 503)


@contextlib.contextmanager
def _variable(name: str, value: str) -> Iterator[None]:
    with unittest.mock.patch.dict("os.environ", {name: value}):
        yield


class Bounds(unittest.TestCase):
    """The limits."""

    def test_an_image_is_drawn_by_any_server(self) -> None:
        """Equal on every server, with its ETag. None for cameras that are not named."""
        with (
            RedisServer() as redis,
            replica("redis-camera", redis.url, RESULTS__IMAGES="hall") as one,
            replica("redis-viewer", redis.url) as other,
        ):
            for camera in ("hall", "hall", "stairs"):
                detect(one, camera)
            path = "/results/hall/latest.jpg?draw=boxes,scores,views,timestamp&width=640"
            wait_until(lambda: metric(one, "results_waiting") == 0.0, "all is stored")
            images = [get(server, path) for server in (one, other)]
            self.assertEqual([image.status for image in images], [200, 200])
            self.assertTrue(images[0].body.startswith(b"\xff\xd8\xff"))
            self.assertEqual(images[0].body, images[1].body)
            latest = get(other, "/results/hall/latest").headers["etag"]
            self.assertEqual([image.headers["etag"] for image in images], [latest, latest])
            self.assertEqual(get(other, path, If_None_Match=latest).status, 304)
            problem = get(other, "/results/stairs/latest.jpg").json()
            self.assertEqual(problem["type"], "/problems/image-not-kept")
            self.assertIn(redis.ask("TTL", "{lookdown}:image:hall"), range(80_000, 86_401))
            self.assertLess(redis.ask("MEMORY", "USAGE", "{lookdown}:image:hall"), 4 << 20)
            # A report from a server that keeps no images removes the previous one.
            detect(other, "hall")
            wait_until(lambda: get(one, path).status == 404, "the image is gone")

    def test_limits_of_the_settings_hold(self) -> None:
        """Cameras, history and reports."""
        bounds = {"RESULTS__MAX_CAMERAS": "3", "RESULTS__HISTORY_PER_CAMERA": "4", "RESULTS__MAX_REPORTS": "8"}
        with RedisServer() as redis, replica("redis-bounds", redis.url, **bounds) as server:
            last = {}
            for camera in "aabcbbbbbaaaacd":
                last[camera] = detect(server, camera).body
            wait_until(lambda: metric(server, "results_waiting") == 0.0, "all is stored")
            rows = get(server, "/results").json()
            self.assertEqual([row["camera"] for row in rows], ["a", "c", "d"])
            self.assertEqual(get(server, "/results/b/latest").status, 404)
            self.assertEqual(len(get(server, "/results/a/history").json()), 4)
            for camera in "acd":
                self.assertEqual(get(server, f"/results/{camera}/latest").body, last[camera])

    def test_storing_and_eviction_are_atomic_and_idempotent(self) -> None:
        """Compares the script with the same rules in a few lines of Python."""
        chance = random.Random(20261121)
        with RedisServer() as redis:
            for _ in range(30):
                redis.ask("FLUSHALL")
                limits = [chance.randrange(1, most) for most in (6, 6, 20, 4000)]
                kept: list[tuple[str, int, int]] = []
                with_image: list[str] = []
                for number in range(1, 60):
                    report = (str(chance.randrange(8)), number, chance.randrange(200, 800))
                    # A sender without an answer sends the report again.
                    redis.ask_all([record(report, limits)] * chance.choice((1, 1, 2)))
                    kept = room_for(kept, report, limits)
                    with_image = [camera for camera in with_image if camera != report[0]] + [report[0]] * has_image(
                        number
                    )
                    with_image = [camera for camera in with_image if any(one[0] == camera for one in kept)][
                        -MOST_IMAGES:
                    ]
                    entries = _entries(redis)
                    self.assertEqual([entry[1:] for entry in entries], [_fields(one) for one in kept])
                    ids = {
                        int(one[1][1]): entry[0] for entry, one in zip(entries, _contents(redis, entries), strict=True)
                    }
                    self.assertEqual(list(ids), [one[1] for one in kept])
                latest = {camera: ids[number] for camera, number, _ in kept}
                by_age = sorted(latest, key=lambda camera: latest[camera])
                self.assertEqual(redis.ask("ZRANGE", "t:cameras", 0, -1), [camera.encode() for camera in by_age])
                self.assertEqual(redis.ask("ZCARD", "t:earlier"), len(kept) - len(latest))
                self.assertEqual(int(redis.ask("HGET", "t:totals", "bytes")), sum(one[2] for one in kept))
                self.assertEqual(len(redis.ask("KEYS", "t:camera:*")), len(latest))
                self.assertEqual(redis.ask("ZRANGE", "t:images", 0, -1), [camera.encode() for camera in with_image])
                self.assertEqual(len(redis.ask("KEYS", "t:image:*")), len(with_image))


def has_image(number: int) -> bool:
    """Returns true if the report of this number has an image."""
    return number % 3 != 0


def record(report: tuple[str, int, int], limits: list[int]) -> tuple:
    """The command that stores a report of a camera, with its number and its size."""
    camera, number, size = report
    keys = [f"t:{name}" for name in ("earlier", "cameras", "latest", "totals", "images", "senders")]
    image = ("frame", "sketch") if has_image(number) else ("", "")
    told = (camera, "t:on", "t:all", "sender", number, "then", number, "{}", *image, size)
    return ("EVAL", RECORD, len(keys), *keys, "t:camera:", "t:image:", *told, *limits, MOST_IMAGES, 3600)


def room_for(
    kept: list[tuple[str, int, int]], report: tuple[str, int, int], limits: list[int]
) -> list[tuple[str, int, int]]:
    """The stored reports, in order, after this report."""
    most_cameras, most_of_camera, most_reports, most_bytes = limits
    kept = [*kept, report]
    own = [one for one in kept if one[0] == report[0]]
    kept = [one for one in kept if one not in own[:-most_of_camera]]

    def latest() -> dict[str, tuple[str, int, int]]:
        return {one[0]: one for one in kept}

    while len(latest()) > most_cameras:
        silent = min(latest().values(), key=lambda one: one[1])[0]
        kept = [one for one in kept if one[0] != silent]
    while kept and (len(kept) > most_reports or sum(one[2] for one in kept) > most_bytes):
        earlier = [one for one in kept if one not in latest().values()]
        kept.remove((earlier or kept)[0])
    return kept


def _fields(report: tuple[str, int, int]) -> tuple[bytes, bytes]:
    return report[0].encode(), str(report[2]).encode()


def _entries(redis: RedisServer) -> list[tuple[bytes, bytes, bytes]]:
    """The ID, the camera and the size of every stored report, in order."""
    earlier = [element.split(b":", 2) for element in redis.ask("ZRANGE", "t:earlier", 0, -1)]
    found = [(micros, camera, size) for micros, size, camera in earlier]
    latest = redis.ask("HGETALL", "t:latest")
    for camera, entry in zip(latest[::2], latest[1::2], strict=True):
        micros, size = entry.split(b":")
        found.append((micros, camera, size))
    return sorted(found)


def _contents(redis: RedisServer, entries: list) -> list:
    """The content of the cameras' streams under the IDs of these entries."""
    asked = [("XRANGE", b"t:camera:" + camera, micros + b"-0", micros + b"-0") for micros, camera, _ in entries]
    found = redis.ask_all(asked) if asked else []
    return [(entry[0][0], entry[0][1][2:4]) for entry in found]


if __name__ == "__main__":
    unittest.main()
