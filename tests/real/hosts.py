"""Separate hosts: network namespaces of Linux on one switch, each with an address. Needs root and iproute2."""

import contextlib
import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass

PREFIX = f"ld{os.getpid() % 100_000}"
NETWORK = "10.213.77"
"""Addresses that are not in use on the machine's networks."""


@dataclass(frozen=True)
class Host:
    """A host that other hosts and this machine reach by its address."""

    name: str
    address: str

    @property
    def inside(self) -> list[str]:
        """The command that runs another one on the host."""
        return ["ip", "netns", "exec", self._namespace]

    def cut_off(self) -> None:
        """Disconnects its cable: packets are lost without an error."""
        _ip("link", "set", self._cable, "down")

    def back(self) -> None:
        """Connects it again."""
        _ip("link", "set", self._cable, "up")

    @property
    def _namespace(self) -> str:
        return f"{PREFIX}-{self.name}"

    @property
    def _cable(self) -> str:
        return f"{PREFIX}{self.name}"

    def build(self, switch: str) -> None:
        """Creates it and connects it to the switch."""
        _ip("netns", "add", self._namespace)
        _ip("link", "add", self._cable, "type", "veth", "peer", "name", "eth0", "netns", self._namespace)
        _ip("link", "set", self._cable, "master", switch, "up")
        for words in (["addr", "add", f"{self.address}/24", "dev", "eth0"], ["link", "set", "eth0", "up"]):
            _ip("-n", self._namespace, *words)
        _ip("-n", self._namespace, "link", "set", "lo", "up")

    def remove(self) -> None:
        """Removes what was created. The cable comes first: the kernel removes the rest of a namespace with a delay."""
        subprocess.run(["ip", "link", "del", self._cable], stderr=subprocess.DEVNULL, check=False)
        subprocess.run(["ip", "netns", "del", self._namespace], stderr=subprocess.DEVNULL, check=False)


@contextlib.contextmanager
def hosts(*names: str) -> Iterator[dict[str, Host]]:
    """Hosts of these names, of at most six letters, while this is open. This machine is the switch."""
    switch = f"{PREFIX}switch"
    with contextlib.ExitStack() as made:
        _ip("link", "add", switch, "type", "bridge")
        made.callback(_ip, "link", "del", switch)
        _ip("addr", "add", f"{NETWORK}.1/24", "dev", switch)
        _ip("link", "set", switch, "up")
        all_hosts = {name: Host(name, f"{NETWORK}.{number}") for number, name in enumerate(names, 2)}
        for host in all_hosts.values():
            made.callback(host.remove)
            host.build(switch)
        yield all_hosts


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True)
