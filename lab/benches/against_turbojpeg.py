"""Compares the decoding of JPEG frames with libjpeg-turbo, as packaged in simplejpeg.

`against_turbojpeg.py [ROUNDS]`, after `scripts/setup.py benches` and `cargo build --release`. The server decodes a
frame on one thread and reports the duration (`timings_ms.decode`: checks, orientation and the RGB copy included).
Then libjpeg-turbo decodes the same bytes on one thread. They alternate, so that other load on the machine affects
both; a ratio is the median over all turns of Lookdown / libjpeg-turbo. The scaled sizes are libjpeg-turbo's alone:
the decoder of Lookdown has no scaled decoding. Prints JSON, one line per frame.
"""

import json
import sys
import time
import urllib.request

import cv2
import numpy as np
import simplejpeg
from harness.frames import frame
from harness.free_network import free_network
from harness.lookdown import detect, lookdown
from harness.places import SAMPLES
from harness.processes import Server

PATH = detect("direct")
PIXELS = f"{PATH}&format=image&draw=none&width=8192"
CHROMA_444 = (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444)
PROGRESSIVE = (cv2.IMWRITE_JPEG_PROGRESSIVE, 1)


def main(rounds: int) -> None:
    with lookdown({"MODEL__PATH": str(free_network(boxes=0))}) as server:
        for name, jpeg in frames().items():
            print(json.dumps({"frame": name} | compare(server, jpeg, rounds)), flush=True)


def frames() -> dict[str, bytes]:
    """JPEG frames: sizes, qualities and encodings."""
    common = frame().read_bytes()
    pixels = cv2.imdecode(np.frombuffer(common, np.uint8), cv2.IMREAD_COLOR)
    return {
        "1680², quality 90, 4:2:0": common,
        "1680², quality 75, 4:2:0": encoded(pixels, 75),
        "1680², quality 90, 4:4:4": encoded(pixels, 90, *CHROMA_444),
        "1680², quality 90, progressive": encoded(pixels, 90, *PROGRESSIVE),
        "3000², quality 90, 4:2:0": frame(3000).read_bytes(),
        "samples/office.jpg": (SAMPLES / "office.jpg").read_bytes(),
        "samples/lounge.jpg": (SAMPLES / "lounge.jpg").read_bytes(),
    }


def encoded(pixels: np.ndarray, quality: int, *options: int) -> bytes:
    """A JPEG file."""
    written, jpeg = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality, *options])
    assert written
    return jpeg.tobytes()


def compare(server: Server, jpeg: bytes, rounds: int) -> dict:
    """The durations and the difference of the pixels."""
    reference = simplejpeg.decode_jpeg(jpeg)
    height, width = reference.shape[:2]
    difference = np.abs(decoded_by(server, jpeg).astype(np.int16) - reference)
    halves = {
        scale: {"min_height": height // scale, "min_width": width // scale, "min_factor": scale} for scale in (2, 4)
    }
    times = []
    for _ in range(rounds):
        ours = json.loads(server.post(PATH, jpeg))["timings_ms"]["decode"]
        times.append((ours, turbo_ms(jpeg), *(turbo_ms(jpeg, **options) for options in halves.values())))
    ours, turbo, half, quarter = np.array(times).T
    return {
        "size": f"{width}x{height}",
        "kib": round(len(jpeg) / 1024),
        "lookdown_ms": figures(ours),
        "turbo_ms": figures(turbo),
        "ratio": round(float(np.median(ours / turbo)), 2),
        "ratio_of_least": round(float(ours.min() / turbo.min()), 2),
        "turbo_half_ms": figures(half),
        "turbo_quarter_ms": figures(quarter),
        "largest_difference": int(difference.max()),
        "pixels_that_differ_by_more_than_1": round(float((difference > 1).any(axis=2).mean()), 5),
    }


def turbo_ms(jpeg: bytes, **options) -> float:
    """The duration of one decoding by libjpeg-turbo, into new memory."""
    started = time.perf_counter()
    simplejpeg.decode_jpeg(jpeg, **options)
    return (time.perf_counter() - started) * 1000


def decoded_by(server: Server, jpeg: bytes) -> np.ndarray:
    """The pixels that the server decodes, from an annotated image without layers."""
    headers = {"Content-Type": "image/jpeg", "Accept": "image/png"}
    request = urllib.request.Request(f"http://{server.address}{PIXELS}", jpeg, headers)
    with urllib.request.urlopen(request, timeout=60) as answer:
        png = answer.read()
    return cv2.cvtColor(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)


def figures(milliseconds: np.ndarray) -> dict[str, float]:
    """Median and minimum."""
    return {"median": round(float(np.median(milliseconds)), 2), "least": round(float(milliseconds.min()), 2)}


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 25)
