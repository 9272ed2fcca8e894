"""Several real replicas: they agree, throughput grows with them, and a lost one loses only requests in flight."""

import contextlib
import json
import os
import signal
import unittest
import urllib.error
import urllib.request

from chain import KEY, LEASTCONN, REPLICAS, Chain, chain
from crowd import crowd, rate
from harness.processes import Server
from state import wait_until
from support.lookdown import TINY
from support.places import OFFICE, SAMPLES

CLIENTS = 12
DETECT = "/detect?calibration=office&profile=fast"
HEADERS = {"Content-Type": "image/jpeg", "X-API-Key": KEY}
ENOUGH = 200
"""Answers after which a change has been under load long enough."""
CORES = 0.4
"""Cores of each replica when throughput is measured: three replicas, HAProxy and the clients fit on two cores."""
LEAST_GROWTH = 2.2
"""Minimum throughput of three replicas relative to one."""


def send(server: Server, method: str, path: str, body: bytes | None = None) -> tuple[int, str, dict]:
    """Status, entity tag and JSON of an answer, also of a refusal."""
    request = urllib.request.Request(f"http://{server.address}{path}", body, HEADERS, method=method)
    with contextlib.ExitStack() as stack:
        try:
            answer = stack.enter_context(urllib.request.urlopen(request, timeout=30))
        except urllib.error.HTTPError as error:
            answer = stack.enter_context(error)
        told = answer.read()
        return answer.status, answer.headers.get("ETag", ""), json.loads(told) if told else {}


def office(focal_factor: float = 1.0) -> bytes:
    """The calibration of the sample, or one that differs slightly."""
    told = json.loads((SAMPLES / "calibrations" / "office.json").read_text(encoding="utf-8"))
    told["lens"]["focal"] *= focal_factor
    return json.dumps(told).encode()


def put_everywhere(servers: dict[str, Server], content: bytes) -> str:
    """Puts the calibration on the first replica and waits for it on all. Returns its entity tag."""
    status, tag, told = send(servers["r1"], "PUT", "/calibrations/office", content)
    assert status in (200, 201), told
    for name, server in servers.items():
        wait_until(
            lambda server=server: send(server, "GET", "/calibrations/office")[1] == tag, f"{name} has the calibration"
        )
    return tag


@unittest.skipIf(os.geteuid(), "only root can make hosts")
class Replicas(unittest.TestCase):
    """Tests without network latency, so that as many requests as possible are in flight."""

    chain: Chain

    @classmethod
    def setUpClass(cls):
        cls.chain = cls.enterClassContext(chain(TINY))
        put_everywhere(cls.chain.replicas, office())

    def test_a_calibration_put_on_one_replica_is_used_by_all(self):
        replicas = self.chain.replicas
        before = put_everywhere(replicas, office())
        after = put_everywhere(replicas, office(1.01))
        self.assertNotEqual(before, after)
        reports = [send(server, "POST", DETECT, OFFICE.read_bytes())[2] for server in replicas.values()]
        self.assertEqual(len({report["calibration"]["revision"] for report in reports}), 1)
        # A conditional write needs the current tag, from any replica.
        status, _, problem = self._put_if_match("r2", before)
        self.assertEqual(status, 412, problem)

    def _put_if_match(self, name: str, tag: str) -> tuple[int, str, dict]:
        url = f"http://{self.chain.replicas[name].address}/calibrations/office"
        request = urllib.request.Request(url, office(), HEADERS | {"If-Match": tag}, method="PUT")
        with self.assertRaises(urllib.error.HTTPError) as caught:
            urllib.request.urlopen(request, timeout=30)
        with caught.exception as answer:
            return answer.status, "", json.loads(answer.read())

    def test_any_replica_returns_the_reports_of_the_others(self):
        replicas = self.chain.replicas
        for finder in REPLICAS:
            status, _, report = send(replicas[finder], "POST", f"{DETECT}&camera=yard", OFFICE.read_bytes())
            self.assertEqual(status, 200, report)

            def latest(name: str) -> tuple[int, str, dict]:
                return send(replicas[name], "GET", "/results/yard/latest")

            for name in REPLICAS:
                found = report["request_id"]
                wait_until(
                    lambda name=name, found=found: latest(name)[2].get("request_id") == found, f"{name} returns it"
                )
            self.assertEqual(len({latest(name)[1] for name in REPLICAS}), 1)

    def test_stopping_replicas_in_turn_loses_no_requests(self):
        with self._load() as seen:
            for name in REPLICAS:
                self._wait_for_answers(seen)
                server = self.chain.replicas[name]
                server.process.send_signal(signal.SIGTERM)
                self.assertEqual(server.process.wait(timeout=30), 0)
                self.chain.start(name)
                self.chain.wait_until(name, "UP")
        self.assertEqual(set(seen.statuses), {200}, seen.statuses)
        print(f"stopped in turns: {seen.statuses.total()} requests, {seen.lost} lost", flush=True)

    def test_killing_a_replica_loses_only_requests_in_flight(self):
        with self._load() as seen:
            self._wait_for_answers(seen)
            gone = self.chain.kill("r2")
            self.chain.wait_until("r2", "DOWN")
            self._wait_for_answers(seen)
            self.chain.start("r2")
            self.chain.wait_until("r2", "UP")
            self._until_it_answers(seen, "r2")
        print(f"killed: {seen.statuses.total()} requests, {seen.lost} lost, {dict(seen.statuses)}", flush=True)
        self.assertEqual([start - gone for start in seen.lost_starts if start >= gone], [], seen.statuses)
        self.assertEqual(seen.statuses[200] + seen.lost, seen.statuses.total(), seen.statuses)

    def test_a_disconnected_replica_loses_little_and_recovers(self):
        with self._load() as seen:
            self._wait_for_answers(seen)
            self.chain.host("r3").cut_off()
            self.addCleanup(self.chain.host("r3").back)
            self.chain.wait_until("r3", "DOWN")
            self._wait_for_answers(seen)
            self.chain.host("r3").back()
            self.chain.wait_until("r3", "UP")
            self._until_it_answers(seen, "r3")
        print(f"cut off: {seen.statuses.total()} requests, {seen.lost} lost, {dict(seen.statuses)}", flush=True)
        self.assertLessEqual(seen.lost, CLIENTS, seen.statuses)
        self.assertEqual(seen.statuses[200] + seen.lost, seen.statuses.total(), seen.statuses)
        report = send(self.chain.replicas["r3"], "POST", f"{DETECT}&camera=gate", OFFICE.read_bytes())[2]
        path, found = "/results/gate/latest", report["request_id"]
        other = self.chain.replicas["r1"]
        wait_until(lambda: send(other, "GET", path)[2].get("request_id") == found, "its results reach the others again")

    def _load(self):
        return crowd(self.chain.front.address, DETECT, OFFICE.read_bytes(), HEADERS, CLIENTS)

    def _wait_for_answers(self, seen):
        enough = seen.statuses[200] + ENOUGH
        wait_until(lambda: seen.statuses[200] >= enough, f"{ENOUGH} more answers have come")

    def _until_it_answers(self, seen, name: str):
        enough = seen.replicas[name] + 1
        wait_until(lambda: seen.replicas[name] >= enough, f"{name} answers again")


@unittest.skipIf(os.geteuid(), "only root can make hosts")
class Growth(unittest.TestCase):
    """Tests with a real network."""

    def test_throughput_grows_with_the_replicas(self):
        settings = {"INFERENCE__SESSIONS": "1", "INFERENCE__THREADS": "1"}
        # A share of a core answers in seconds: throughput is tested, not the time of an answer.
        patient = LEASTCONN.replace("timeout server 5s", "timeout server 30s")
        with chain(settings, CORES, patient) as replicas:
            put_everywhere(replicas.replicas, office())
            rates = []
            for count in (1, 2, 3):
                replicas.serve_with(count)
                with crowd(replicas.front.address, DETECT, OFFICE.read_bytes(), HEADERS, 4 * count) as seen:
                    wait_until(lambda seen=seen: seen.statuses[200] >= 4, "the first answers have come")
                    rates.append(rate(seen, 15.0))
                self.assertEqual(set(seen.statuses), {200})
        told = ", ".join(f"{count}: {each:.2f}" for count, each in enumerate(rates, 1))
        print(f"frames a second by replicas of {CORES} cores: {told}", flush=True)
        self.assertGreaterEqual(rates[2], LEAST_GROWTH * rates[0])
