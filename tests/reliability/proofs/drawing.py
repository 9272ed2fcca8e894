"""Drawing into a frame of nearly the largest permitted size takes at most twice the time of its detection."""

import time

from support.effort import Effort
from support.exchange import ask
from support.frames import enlarged, png_rows
from support.lookdown import lookdown
from support.places import OFFICE
from support.row import Row

FACTOR, ROWS = 8, 800
"""960 × 800 pixels of the sample become 7680 × 6400, just below `limits.max_image_pixels`."""
MOST = 2.0
"""Drawing and encoding, in times of decoding and inference."""
REPEATS = 4
FRAME = "/detect?profile=fast&score_threshold=0"
EVERYTHING = "draw=boxes,oriented,scores,zones,views"
DRAWN = (
    "format=image",
    "format=image&width=7680",
    "format=image&width=7680&quality=100",
    f"format=image&{EVERYTHING}",
    f"format=image&width=4096&{EVERYTHING}",
    f"format=image&width=7680&{EVERYTHING}",
)


def prove(effort: Effort) -> list[Row]:
    """Compares the fastest of a few requests with and without drawing, by turns."""
    del effort
    row = Row("drawing of the largest images", f"JPEG of {960 * FACTOR}×{ROWS * FACTOR} pixels, every candidate drawn")
    with lookdown({"LOG__FILTER": "error"}) as server:
        accept = {"Accept": "image/png"}
        sample = ask(server.address, "POST", "/detect?profile=fast&draw=none", OFFICE.read_bytes(), accept)
        large = enlarged(png_rows(sample.body)[:ROWS], FACTOR)
        # An image that nothing is drawn into is the frame as a JPEG.
        jpeg = ask(server.address, "POST", "/detect?profile=fast&format=image&draw=none&width=8192", large).body
        times = {query: [_seconds(row, server.address, query, jpeg)] for query in ("format=json", *DRAWN)}
        for _ in range(REPEATS - 1):
            for query, seconds in times.items():
                seconds.append(_seconds(row, server.address, query, jpeg))
    detection, *others = (min(seconds) for seconds in times.values())
    ratios = [other / detection - 1 for other in others]
    for query, ratio in zip(DRAWN, ratios, strict=True):
        row.require(ratio <= MOST, f"{query}: drawing took {ratio:.2f} times the detection, {MOST} are permitted")
    row.seen = f"detection {detection:.2f} s; drawing {', '.join(f'{ratio:.2f}' for ratio in ratios)} times that"
    return [row]


def _seconds(row: Row, address: str, query: str, jpeg: bytes) -> float:
    began = time.monotonic()
    status = ask(address, "POST", f"{FRAME}&{query}", jpeg).status
    row.require(status == 200, f"{query} was answered {status}")
    return time.monotonic() - began
