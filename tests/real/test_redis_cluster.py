"""Servers that share a Redis Cluster: listeners that resume lose no report, and get none twice, whatever moves."""

import contextlib
import http.client
import itertools
import json
import os
import threading
import time
import unittest
from collections.abc import Iterator

from harness.processes import Server
from hosts import Host, hosts
from redis_cluster import RedisCluster, redis_cluster
from test_redis import Stream, detect, get, replica
from waiting import PATIENCE_SECONDS, wait_until

from metrics import metric

NODES = ("n1", "n2", "n3", "n4")
SERVERS = ("s1", "s2", "s3")
OUTAGE_SECONDS = 60.0
CAMERAS = ("hall", "lift", "yard")
EVENTS_IN_A_ROW = 7
"""The events after which a listener moves to another server."""
SETTINGS = {"ACCESS__OPEN": "true", "RESULTS__HISTORY_PER_CAMERA": "5000", "RESULTS__MAX_REPORTS": "20000"}


class Listener(threading.Thread):
    """Follows a camera, or all, on one server after the other, and resumes each time."""

    def __init__(self, servers: list[Server], path: str) -> None:
        super().__init__(daemon=True)
        self._turns = itertools.cycle(servers)
        self._path = path
        self.ids: list[int] = []
        self.requests: list[str] = []
        self.moves = 0
        self.over = threading.Event()

    def run(self) -> None:
        """Follows until it is over."""
        while not self.over.is_set():
            resume = {"Last_Event_ID": str(self.ids[-1])} if self.ids else {}
            # A server may have lost its Redis (503), or the stream may end.
            with contextlib.suppress(AssertionError, OSError, http.client.HTTPException):
                self._follow(Stream(next(self._turns), self._path, **resume))
            time.sleep(0.05)

    def _follow(self, stream: Stream) -> None:
        self.moves += 1
        with contextlib.closing(stream):
            for _ in range(EVENTS_IN_A_ROW):
                identifier, data = stream.next()
                self.ids.append(int(identifier))
                self.requests.append(json.loads(data)["request_id"])


class Sender(threading.Thread):
    """Sends frames of a camera to one server after the other."""

    def __init__(self, servers: list[Server], camera: str) -> None:
        super().__init__(daemon=True)
        self._turns = itertools.cycle(servers)
        self._camera = camera
        self.sent: list[str] = []
        self.over = threading.Event()

    def run(self) -> None:
        """Sends until it is over."""
        while not self.over.is_set():
            answer = detect(next(self._turns), self._camera)
            if answer.status == 200:
                self.sent.append(answer.json()["request_id"])
            time.sleep(0.05)


@unittest.skipIf(os.geteuid(), "only root can make hosts")
class Moves(unittest.TestCase):
    """Listeners, a slot and a node that move while frames arrive. Each node and each server has a host of its own."""

    machines: dict[str, Host]

    @classmethod
    def setUpClass(cls) -> None:
        """Builds the hosts once for all tests."""
        cls.machines = cls.enterClassContext(hosts(*NODES, *SERVERS))

    def test_moving_listeners_miss_no_report_and_get_none_twice(self) -> None:
        """The listeners move between the servers without a pause."""
        with self._cluster() as cluster, self._load(cluster, "moving"):
            time.sleep(10)

    def test_moving_a_slot_under_load_loses_no_report(self) -> None:
        """Twice, to two nodes."""
        with self._cluster() as cluster, self._load(cluster, "slot"):
            for _ in range(2):
                time.sleep(3)
                before = cluster.serving()
                after = cluster.move_slot()
                self.assertIsNot(before, after)
                self.assertIs(cluster.serving(), after)
            time.sleep(3)

    def test_killing_the_serving_node_loses_no_stored_report(self) -> None:
        """Its copy takes over."""
        with self._cluster() as cluster, self._load(cluster, "node"):
            time.sleep(3)
            cluster.serving().kill()
            wait_until(cluster.is_served, "the copy serves the slot")
            time.sleep(3)

    def test_cutting_off_the_serving_node_loses_no_stored_report(self) -> None:
        """Packets from and to it are lost without an error. Its copy takes over, and it returns as a copy."""
        with self._cluster() as cluster, self._load(cluster, "cable"):
            time.sleep(3)
            node = cluster.serving()
            machine = next(machine for machine in self.machines.values() if machine.address == node.host)
            machine.cut_off()
            wait_until(cluster.is_served, "the copy serves the slot", OUTAGE_SECONDS)
            time.sleep(3)
            machine.back()
            wait_until(lambda: cluster.is_copy(node), "the node that was cut off is a copy", OUTAGE_SECONDS)
            time.sleep(3)

    def test_lost_subscriptions_are_caught_up_without_a_gap(self) -> None:
        """Redis closes the connections with subscriptions, again and again."""
        with self._cluster() as cluster, self._load(cluster, "lost"):
            for _ in range(10):
                time.sleep(1)
                cluster.serving().ask("CLIENT", "KILL", "TYPE", "pubsub")

    def _cluster(self) -> contextlib.AbstractContextManager[RedisCluster]:
        return redis_cluster([self.machines[name] for name in NODES])

    @contextlib.contextmanager
    def _load(self, cluster: RedisCluster, name: str) -> Iterator[None]:
        with contextlib.ExitStack() as stack:
            servers = [
                stack.enter_context(self._replica(f"redis-cluster-{name}-{server}", server, node.url))
                for server, node in zip(SERVERS, cluster.nodes, strict=False)
            ]
            for camera in CAMERAS:
                detect(servers[0], camera)
            wait_until(lambda: len(get(servers[1], "/results").json()) == len(CAMERAS), "all cameras are known")
            listeners = {camera: Listener(servers, f"/results/{camera}/events") for camera in CAMERAS}
            everything = Listener(servers, "/events")
            followers = [*listeners.values(), everything]
            senders = {camera: Sender(servers, camera) for camera in CAMERAS}
            for thread in followers:
                thread.start()
            wait_until(lambda: all(listener.ids for listener in followers), "all listeners have begun")
            for thread in senders.values():
                thread.start()
            yield
            for sender in senders.values():
                sender.over.set()
                sender.join(PATIENCE_SECONDS)
            wait_until(
                lambda: all(metric(server, "results_waiting") == 0.0 for server in servers), "all reports are stored"
            )
            self._compare(listeners, everything, senders)
            for listener in followers:
                listener.over.set()
            dropped = sum(metric(server, "results_dropped_total") for server in servers)
            self.assertEqual(dropped, 0.0)

    def _replica(self, name: str, server: str, url: str) -> contextlib.AbstractContextManager[Server]:
        machine = self.machines[server]
        return replica(name, url, machine.address, machine.inside, **SETTINGS)

    def _compare(self, listeners: dict[str, Listener], everything: Listener, senders: dict[str, Sender]) -> None:
        sent = {camera: set(sender.sent) for camera, sender in senders.items()}
        union = set().union(*sent.values())
        with contextlib.suppress(AssertionError):
            wait_until(lambda: union <= set(everything.requests), "the listener to all has received every report")
        for camera, listener in listeners.items():
            with contextlib.suppress(AssertionError):
                wait_until(lambda camera=camera, it=listener: sent[camera] <= set(it.requests), "the last are received")
            self.assertEqual(sent[camera] - set(listener.requests), set(), f"lost: {camera}")
        self.assertEqual(union - set(everything.requests), set(), "lost: all")
        for listener in (*listeners.values(), everything):
            self.assertEqual(len(listener.requests), len(set(listener.requests)), "no report is received twice")
            self.assertEqual(listener.ids, sorted(set(listener.ids)))
        moves = sum(listener.moves for listener in listeners.values()) + everything.moves
        print(f"{len(union)} reports, {moves} moves of listeners", end=" ... ", flush=True)


if __name__ == "__main__":
    unittest.main()
