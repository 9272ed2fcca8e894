"""Images that cost a decoder far more than their sender."""

import struct
import zlib
from collections.abc import Iterable


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
