"""An RTSP server that loops the JPEG files of a folder as H.264: `rtsp_server.py PORT FOLDER RATE [USER PASSWORD]`.

It is a program of its own, because GStreamer is only available to Debian's Python.
"""

import sys

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


def serve(server: GstRtspServer.RTSPServer, factory: GstRtspServer.RTSPMediaFactory) -> None:
    """Serves `/stream` until the process is stopped."""
    server.get_mount_points().add_factory("/stream", factory)
    server.attach(None)
    GLib.MainLoop().run()


def main(port: str, folder: str, rate: str, *login: str) -> None:
    """Serves the files of a folder."""
    Gst.init(None)
    server = GstRtspServer.RTSPServer(service=port, address="127.0.0.1")
    factory = GstRtspServer.RTSPMediaFactory(shared=True)
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
    serve(server, factory)


if __name__ == "__main__":
    main(*sys.argv[1:])
