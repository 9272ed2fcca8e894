"""A Redis Cluster for tests: three nodes that serve the slots, and a copy of the one with the results."""

import contextlib
from collections.abc import Iterator

from harness.processes import free_ports
from hosts import Host
from redis_server import RedisError, RedisServer
from waiting import wait_until

KEY = "{lookdown}:totals"
SLOTS = 16384


class RedisCluster:
    """Four nodes. They store nothing on disk but their list of nodes."""

    def __init__(self, nodes: list[RedisServer]) -> None:
        """Joins nodes that are started."""
        self.nodes = nodes
        self.slot = nodes[0].ask("CLUSTER", "KEYSLOT", KEY)
        for number, node in enumerate(nodes[:3]):
            first, last = (SLOTS * each // 3 for each in (number, number + 1))
            node.ask("CLUSTER", "ADDSLOTSRANGE", first, last - 1)
            node.ask("CLUSTER", "SET-CONFIG-EPOCH", number + 1)
        for node in nodes[1:]:
            place = node.host, node.port, node.bus_port
            wait_until(lambda place=place: nodes[0].ask("CLUSTER", "MEET", *place), "the nodes meet")
        wait_until(lambda: all(node.ask("CLUSTER", "INFO").count(b"cluster_state:ok") for node in nodes), "all agree")
        self._copy(nodes[3], self.serving())

    def _copy(self, copy: RedisServer, node: RedisServer) -> None:
        copy.ask("CLUSTER", "REPLICATE", node.ask("CLUSTER", "MYID"))
        wait_until(lambda: b"master_link_status:up" in copy.ask("INFO", "replication"), "the copy is complete")

    def serving(self) -> RedisServer:
        """The node that serves the slot of the results."""
        return next(node for node in self.nodes if self._serves(node))

    def is_served(self) -> bool:
        """Returns true if a node serves the slot, and the cluster works."""
        return any(self._serves(node) for node in self.nodes)

    def is_copy(self, node: RedisServer) -> bool:
        """Returns true if the node answers that it copies another one."""
        with contextlib.suppress(OSError, RedisError):
            return b"role:slave" in node.ask("INFO", "replication")
        return False

    def _serves(self, node: RedisServer) -> bool:
        with contextlib.suppress(OSError, RedisError):
            node.ask("HGET", KEY, "last")
            return b"role:master" in node.ask("INFO", "replication")
        return False

    def move_slot(self) -> RedisServer:
        """Moves the slot of the results to another node, which is returned."""
        source = self.serving()
        target = next(
            node for node in self.nodes[:3] if node is not source and b"role:master" in node.ask("INFO", "replication")
        )
        names = {node.port: node.ask("CLUSTER", "MYID").decode() for node in (source, target)}
        target.ask("CLUSTER", "SETSLOT", self.slot, "IMPORTING", names[source.port])
        source.ask("CLUSTER", "SETSLOT", self.slot, "MIGRATING", names[target.port])
        while keys := source.ask("CLUSTER", "GETKEYSINSLOT", self.slot, 10):
            source.ask("MIGRATE", target.host, target.port, "", 0, 5000, "KEYS", *keys)
        for node in (target, source):
            node.ask("CLUSTER", "SETSLOT", self.slot, "NODE", names[target.port])
        return target


@contextlib.contextmanager
def redis_cluster(machines: list[Host]) -> Iterator[RedisCluster]:
    """Starts a node on each of four hosts and joins them."""
    with contextlib.ExitStack() as stack:
        nodes = []
        for machine, bus_port in zip(machines, free_ports(4), strict=True):
            options = ["--cluster-enabled", "yes", "--cluster-port", str(bus_port), "--cluster-node-timeout", "1500"]
            options += ["--repl-diskless-sync-delay", "0"]
            node = stack.enter_context(RedisServer(*options, host=machine.address, inside=machine.inside))
            node.bus_port = bus_port
            nodes.append(node)
        yield RedisCluster(nodes)
