"""The largest permitted load at the default limits, in the memory limit of the Kubernetes manifest."""

import contextlib
import re
import socket
import threading
import time
from collections import Counter

from support.effort import Effort
from support.exchange import ask
from support.frames import noise_png, png
from support.lookdown import DETECT, lookdown
from support.memory_group import memory_group
from support.places import OFFICE
from support.row import Row

LIMIT_MIB = 2048
"""`resources.limits.memory` of k8s/base/deployment.yaml."""
CPUS = "0,1"
"""As many as `resources.limits.cpu` there."""
CACHE_MIB = 256
"""The default of `calibrations.cache_bytes`."""
RESULTS_MIB = 64
"""The default of `results.max_bytes`."""
UPLOADS, UPLOAD_BYTES, UPLOADED = 8, 32 << 20, 31 << 20
"""Bodies that never end: together as large as `limits.max_upload_bytes`."""
CAMERAS = 20
SIDES = (8192, 6100)
"""Just below `limits.max_image_side` and `limits.max_image_pixels`."""
IMAGE = "/detect?profile=fast&format=image"


def prove(effort: Effort) -> Row:
    """Holds uploads, and sends the largest frames whose large responses are not read."""
    deep, noise = png(*SIDES, bits=16), noise_png(*SIDES)
    # The unread responses to the first are still there when the others are decoded.
    kinds = [
        (f"{IMAGE}&width=8192", "image/png", noise),
        (IMAGE, "image/jpeg", deep),
        ("/detect?profile=fast", "application/json", deep),
    ]
    row = Row(
        "memory at the default limits",
        f"{LIMIT_MIB} MiB, 2 cores; {CAMERAS} cameras, {UPLOADS} held uploads, frames of {SIDES[0]}×{SIDES[1]} pixels "
        "of 16 bits and of noise, with images that are not read",
    )
    with memory_group(LIMIT_MIB) as group:
        if group is None:
            row.skipped = "needs root and a control group for memory"
            return row
        inside = [*group.inside(), "taskset", "-c", CPUS]
        with lookdown({"LOG__FILTER": "error"}, inside=inside) as server, contextlib.ExitStack() as held:
            address = server.address
            for number in range(CAMERAS):
                path = f"{DETECT}&camera=hall{number}&motion=true&cache=true"
                ask(address, "POST", path, OFFICE.read_bytes())
            tables = _rig_cache_mib(address)
            finished = threading.Event()
            uploads = [_begin_upload(address, held) for _ in range(UPLOADS)]
            dripping = threading.Thread(target=_drip, args=(uploads, finished))
            dripping.start()
            seconds = effort.default_limit_seconds / 2
            answers = [
                *_send_all(address, kinds[:1], 6, seconds, held),
                *_send_all(address, kinds[1:], 3, seconds, held),
            ]
            finished.set()
            dripping.join()
            alive = server.process.poll() is None
            held.close()
            good = ask(address, "POST", DETECT, OFFICE.read_bytes()).status if alive else "no answer"
        peak, kills = group.peak_mib(), group.kills()
    unused = CACHE_MIB - tables + RESULTS_MIB
    for (path, media_type, _), counted in zip(kinds, answers, strict=True):
        others = {status: count for status, count in counted.items() if status not in (200, 429)}
        row.require(not others, f"{path} as {media_type} was answered {dict(counted)}")
    row.require(alive and not kills, f"the server was killed ({kills} times)")
    row.require(peak + unused <= LIMIT_MIB, f"{peak:.0f} MiB, and {unused:.0f} MiB of caches that may still fill")
    row.require(good == 200, f"a good frame afterwards was answered {good}")
    total = dict(sorted(sum(answers, Counter()).items(), key=str))
    row.require(200 in total, "no frame was answered")
    row.seen = (
        f"answered {total}; at most {peak:.0f} MiB, with full remap tables and reports {peak + unused:.0f} MiB; "
        f"a good frame afterwards: {good}"
    )
    return row


def _rig_cache_mib(address: str) -> float:
    metrics = ask(address, "GET", "/metrics").body.decode()
    found = re.search(r"^lookdown_rig_cache_bytes (\d+)", metrics, re.MULTILINE)
    return int(found[1]) / 2**20 if found else 0.0


def _connect(address: str) -> socket.socket:
    host, _, port = address.rpartition("//")[2].rpartition(":")
    client = socket.socket()
    # A small window, so that the server holds what is not read.
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.settimeout(60)
    client.connect((host, int(port)))
    return client


def _head(path: str, accept: str, length: int) -> bytes:
    return f"POST {path} HTTP/1.1\r\nHost: localhost\r\nAccept: {accept}\r\nContent-Length: {length}\r\n\r\n".encode()


def _begin_upload(address: str, held: contextlib.ExitStack) -> socket.socket:
    upload = held.enter_context(_connect(address))
    upload.sendall(_head("/detect", "*/*", UPLOAD_BYTES))
    with contextlib.suppress(OSError):
        upload.sendall(bytes(UPLOADED))
    return upload


def _drip(uploads: list[socket.socket], finished: threading.Event) -> None:
    while not finished.wait(1):
        for upload in uploads:
            with contextlib.suppress(OSError):
                upload.sendall(bytes(4096))


def _send_all(address: str, kinds: list, clients: int, seconds: float, held: contextlib.ExitStack) -> list[Counter]:
    """Sends frames of each kind from some clients, and reads only the status of each response."""
    answers = [Counter() for _ in kinds]
    until = time.monotonic() + seconds
    lock = threading.Lock()

    def send(kind: int) -> None:
        path, accept, frame = kinds[kind]
        while time.monotonic() < until:
            status: int | str
            client = _connect(address)
            with lock:
                held.callback(client.close)
            try:
                client.sendall(_head(path, accept, len(frame)) + frame)
                status = int(client.recv(12)[9:] or 0)
            except OSError as error:
                status = str(error)
            with lock:
                answers[kind][status] += 1
            if status != 200:
                client.close()
                time.sleep(0.2)

    threads = [threading.Thread(target=send, args=(kind,)) for kind in range(len(kinds)) for _ in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return answers
