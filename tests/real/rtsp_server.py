"""An RTSP server of H.264: `rtsp_server.py PORT FOLDER RATE [USER PASSWORD]` loops the JPEG files of a folder, and
`rtsp_server.py PORT clock RATE BITS` serves images that show the time at which they were made.

The lowest bits of the system's clock in milliseconds stand in the upper rows of the clock as black and white blocks, the
highest bit first. It is a program of its own, because GStreamer is only available to Debian's Python.
"""

import sys
import threading
import time

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtsp", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtsp, GstRtspServer  # noqa: E402

ROLE = "viewer"
# One thread writes one slice for each frame. rtph264pay repeats the parameter sets before every slice of a key frame,
# which would end the frame after its first slice.
ENCODED = (
    "x264enc tune=zerolatency speed-preset=ultrafast key-int-max=10 threads=1 ! rtph264pay name=pay0 config-interval=-1"
)
"""The end of a pipeline, from raw images on."""


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


def clock(factory: GstRtspServer.RTSPMediaFactory, rate: int, bits: int) -> None:
    """Serves the clock."""
    size = f"width={bits * BLOCK},height={HEIGHT}"
    factory.set_launch(
        "( appsrc name=source is-live=true do-timestamp=true format=time"
        f" caps=video/x-raw,format=I420,{size},framerate={rate}/1 ! {ENCODED} )"
    )
    fed = lambda _, media: threading.Thread(target=feed, args=(media, rate, bits), daemon=True).start()
    factory.connect("media-configure", fed)


def files(
    server: GstRtspServer.RTSPServer, factory: GstRtspServer.RTSPMediaFactory, folder: str, rate: str, *login: str
) -> None:
    """Serves the files of a folder, to a user if there is one."""
    factory.set_launch(
        f"( multifilesrc location={folder}/%d.jpg loop=true caps=image/jpeg,framerate={rate}/1 ! jpegdec"
        f" ! videoconvert ! video/x-raw,format=I420 ! identity sync=true ! {ENCODED} )"
    )
    if login:
        user, password = login
        auth = GstRtspServer.RTSPAuth()
        auth.set_supported_methods(GstRtsp.RTSPAuthMethod.DIGEST)
        token = GstRtspServer.RTSPToken()
        token.set_string(GstRtspServer.RTSP_TOKEN_MEDIA_FACTORY_ROLE, ROLE)
        auth.add_digest(user, password, token)
        server.set_auth(auth)
        permissions = GstRtspServer.RTSPPermissions()
        for permission in ("media.factory.access", "media.factory.construct"):
            permissions.add_permission_for_role(ROLE, permission, True)
        factory.set_permissions(permissions)


def main(port: str, source: str, rate: str, *more: str) -> None:
    """Serves `/stream` until the process is stopped."""
    Gst.init(None)
    server = GstRtspServer.RTSPServer(service=port, address="127.0.0.1")
    factory = GstRtspServer.RTSPMediaFactory(shared=True)
    if source == "clock":
        clock(factory, int(rate), *map(int, more))
    else:
        files(server, factory, source, rate, *more)
    server.get_mount_points().add_factory("/stream", factory)
    server.attach(None)
    GLib.MainLoop().run()


if __name__ == "__main__":
    main(*sys.argv[1:])
