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


def png_rows(image: bytes) -> list[bytes]:
    """The rows of an RGB PNG of 8 bits a channel (filters: PNG specification, section 9)."""
    width, packed, at = int.from_bytes(image[16:20], "big"), b"", 8
    while at < len(image):
        length = int.from_bytes(image[at : at + 4], "big")
        if image[at + 4 : at + 8] == b"IDAT":
            packed += image[at + 8 : at + 8 + length]
        at += 12 + length
    data, size = zlib.decompress(packed), 3 * width
    above, rows = bytes(size), []
    for start in range(0, len(data), size + 1):
        above = _unfiltered(data[start], data[start + 1 : start + 1 + size], above)
        rows.append(above)
    return rows


def _unfiltered(kind: int, row: bytes, above: bytes) -> bytes:
    out = bytearray(3) + row
    for at in range(3, len(out)):
        left, up, corner = out[at - 3], above[at - 3], above[at - 6] if at >= 6 else 0
        out[at] = (out[at] + (0, left, up, (left + up) // 2, _paeth(left, up, corner))[kind]) % 256
    return bytes(out[3:])


def _paeth(left: int, up: int, corner: int) -> int:
    guess = left + up - corner
    return min((left, up, corner), key=lambda value: abs(value - guess))


def enlarged(rows: list[bytes], factor: int) -> bytes:
    """An RGB PNG whose pixels are squares of `factor` pixels."""
    wide = (b"\0" + b"".join(row[at : at + 3] * factor for at in range(0, len(row), 3)) for row in rows)
    return _png(len(rows[0]) // 3 * factor, len(rows) * factor, 8, (row for row in wide for _ in range(factor)))


def _png(width: int, height: int, bits: int, rows: Iterable[bytes]) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0)
    packer = zlib.compressobj(6)
    packed = b"".join(map(packer.compress, rows)) + packer.flush()
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", packed) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
