"""An RTSP server whose images show the time at which they were made: `rtsp_clock.py PORT RATE BITS`.

The lowest bits of the system's clock in milliseconds stand in the upper rows as black and white blocks, the highest bit first. It is a
program of its own, because GStreamer is only available to Debian's Python.
"""

import sys
import threading
import time

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import Gst, GstRtspServer  # noqa: E402
from rtsp_server import ENCODED, serve  # noqa: E402

BLOCK, HEIGHT = 32, 384
BLACK, WHITE, GREY = 16, 235, 128


def frame(milliseconds: int, bits: int) -> bytes:
    """An image in I420 with the lowest bits of a time."""
    shown = [milliseconds >> bit & 1 for bit in reversed(range(bits))]
    row = b"".join(bytes([WHITE if bit else BLACK]) * BLOCK for bit in shown)
    # Gray below, and no color: half a byte for each pixel.
    return row * (2 * BLOCK) + bytes([GREY]) * (len(row) * (HEIGHT - 2 * BLOCK + HEIGHT // 2))


def feed(media: GstRtspServer.RTSPMedia, rate: int, bits: int) -> None:
    """Gives the source of a stream an image at each interval until it takes no more."""
    source = media.get_element().get_child_by_name("source")
    due = time.monotonic()
    push = lambda data: source.emit("push-buffer", Gst.Buffer.new_wrapped(data))
    while push(frame(time.time_ns() // 1_000_000, bits)) == Gst.FlowReturn.OK:
        due += 1 / rate
        time.sleep(max(0.0, due - time.monotonic()))


def main(port: str, rate: str, bits: str) -> None:
    """Serves the clock."""
    Gst.init(None)
    server = GstRtspServer.RTSPServer(service=port, address="127.0.0.1")
    factory = GstRtspServer.RTSPMediaFactory(shared=True)
    size = f"width={int(bits) * BLOCK},height={HEIGHT}"
    factory.set_launch(
        "( appsrc name=source is-live=true do-timestamp=true format=time"
        f" caps=video/x-raw,format=I420,{size},framerate={rate}/1 ! {ENCODED} )"
    )
    fed = lambda _, media: threading.Thread(target=feed, args=(media, int(rate), int(bits)), daemon=True).start()
    factory.connect("media-configure", fed)
    serve(server, factory)


main(*sys.argv[1:])
