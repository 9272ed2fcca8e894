"""An RTSP server whose pictures show the time at which they were made: `rtsp_clock.py PORT RATE`.

The milliseconds of the system's clock stand in the upper rows as black and white blocks, the highest bit first. It is a
program of its own, because GStreamer is only available to Debian's Python.
"""

import sys
import threading
import time

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402

BITS, BLOCK, HEIGHT = 24, 32, 384
WIDTH = BITS * BLOCK
BLACK, WHITE, GREY = 16, 235, 128


def picture(milliseconds: int) -> bytes:
    """A picture in I420 with the lowest bits of a time."""
    bits = [milliseconds >> (BITS - 1 - bit) & 1 for bit in range(BITS)]
    row = b"".join(bytes([WHITE if bit else BLACK]) * BLOCK for bit in bits)
    chroma = bytes([GREY]) * (WIDTH * HEIGHT // 2)
    return row * (2 * BLOCK) + bytes([GREY]) * (WIDTH * (HEIGHT - 2 * BLOCK)) + chroma


def feed(media: GstRtspServer.RTSPMedia, rate: int) -> None:
    """Gives the source of a stream a picture at each interval until it takes no more."""
    source = media.get_element().get_child_by_name("source")
    due = time.monotonic()
    while source.emit("push-buffer", Gst.Buffer.new_wrapped(picture(time.time_ns() // 1_000_000))) == Gst.FlowReturn.OK:
        due += 1 / rate
        time.sleep(max(0.0, due - time.monotonic()))


def main(port: str, rate: str) -> None:
    """Serves `/stream` until the process is stopped."""
    Gst.init(None)
    server = GstRtspServer.RTSPServer(service=port, address="127.0.0.1")
    factory = GstRtspServer.RTSPMediaFactory(shared=True)
    factory.set_launch(
        "( appsrc name=source is-live=true do-timestamp=true format=time"
        f" caps=video/x-raw,format=I420,width={WIDTH},height={HEIGHT},framerate={rate}/1"
        " ! x264enc tune=zerolatency speed-preset=ultrafast key-int-max=10 threads=1"
        " ! rtph264pay name=pay0 config-interval=-1 )"
    )
    start = lambda _, media: threading.Thread(target=feed, args=(media, int(rate)), daemon=True).start()
    factory.connect("media-configure", start)
    server.get_mount_points().add_factory("/stream", factory)
    server.attach(None)
    GLib.MainLoop().run()


main(*sys.argv[1:])
