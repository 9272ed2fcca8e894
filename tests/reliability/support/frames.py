"""Images that cost a decoder far more than their sender."""

import random
import struct
import zlib
from collections.abc import Iterable


def png(width: int, height: int, rows: int | None = None, bits: int = 8) -> bytes:
    """A black RGB image. With `rows`, its data end after that many."""
    row = bytes(1 + 3 * width * bits // 8)
    return _png(width, height, bits, (row for _ in range(height if rows is None else rows)))


def noise_png(width: int, height: int) -> bytes:
    """An RGB image that is small here, as each row repeats the same noise at another offset.

    A fast encoder does not find the repetitions, so the server's image takes three bytes a pixel.
    """
    generator = random.Random(21)
    period = 16_000
    noise = generator.randbytes(period) * (3 * width // period + 2)
    offsets = (generator.randrange(period) for _ in range(height))
    return _png(width, height, 8, (b"\0" + noise[at : at + 3 * width] for at in offsets))


def _png(width: int, height: int, bits: int, rows: Iterable[bytes]) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0)
    packer = zlib.compressobj(6)
    packed = b"".join(map(packer.compress, rows)) + packer.flush()
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", packed) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
