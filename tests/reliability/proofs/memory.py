"""Huge frames to a server with little memory: they are refused before they use any."""

import struct
import threading
import zlib
from collections import Counter
from collections.abc import Iterable

from support.control_group import memory_group
from support.effort import Effort
from support.exchange import Lost, ask
from support.lookdown import DETECT, TINY, lookdown
from support.places import OFFICE
from support.row import Row

LIMIT_MIB = 384
SETTINGS = TINY | {
    "LOG__FILTER": "error",
    "LIMITS__MAX_IMAGE_PIXELS": "4000000",
    "LIMITS__MAX_DECODE_BYTES": "67108864",
    "LIMITS__MAX_UPLOAD_BYTES": "67108864",
}
"""The settings for a small machine."""
AT_ONCE = 16


def frames() -> dict[str, tuple[bytes, set[int]]]:
    """The frames, with the permitted statuses."""
    return {
        "of 50 000 × 50 000 pixels": (png(50_000, 50_000, rows=1), {413}),
        "of 8192 × 6000 pixels": (png(8192, 6000), {413}),
        "of a thousand times its bytes": (png(2000, 2000), {200, 422, 429}),
        "of 40 MB": (bytes(40_000_000), {413, 429}),
        "of 30 MB that are not images": (bytes(30_000_000), {415, 429}),
    }


def prove(effort: Effort) -> list[Row]:
    """Sends huge frames to a small server."""
    made = frames()
    row = Row(
        "memory limit", f"{LIMIT_MIB} MiB; {len(made)} kinds of huge frames, {effort.huge_frames} × {AT_ONCE} of each"
    )
    with memory_group(LIMIT_MIB) as group:
        if group is None:
            row.skipped = "needs root and a control group for memory"
            return [row]
        with lookdown(SETTINGS, inside=group.inside()) as server:
            answers = {name: _send(server.address, frame, effort.huge_frames) for name, (frame, _) in made.items()}
            good = ask(server.address, "POST", DETECT, OFFICE.read_bytes()).status
            alive = server.process.poll() is None
        peak, kills = group.peak_mib(), group.kills()
    for name, (_, expected) in made.items():
        others = {status: count for status, count in answers[name].items() if status not in expected}
        row.require(not others, f"frames {name} were answered {others}")
    row.require(alive and not kills, f"the server was killed ({kills} times)")
    row.require(good == 200, f"a good frame afterwards was answered {good}")
    total = sum((counted for counted in answers.values()), Counter())
    row.seen = f"answered {dict(sorted(total.items()))}; at most {peak:.0f} MiB; a good frame afterwards: {good}"
    return [row]


def _send(address: str, frame: bytes, rounds: int) -> Counter:
    answers: Counter = Counter()
    lock = threading.Lock()

    def send() -> None:
        for _ in range(rounds):
            try:
                answer = ask(address, "POST", "/detect?profile=fast", frame).status
            except (Lost, OSError) as error:
                answer = f"nothing ({error})"
            with lock:
                answers[answer] += 1

    threads = [threading.Thread(target=send) for _ in range(AT_ONCE)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return answers


def png(width: int, height: int, rows: int | None = None) -> bytes:
    """A black RGB image. With `rows`, its data end after that many."""
    row = bytes(1 + 3 * width)
    return _png(width, height, (row for _ in range(height if rows is None else rows)))


def _png(width: int, height: int, rows: Iterable[bytes]) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    packer = zlib.compressobj(6)
    packed = b"".join(map(packer.compress, rows)) + packer.flush()
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", packed) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
