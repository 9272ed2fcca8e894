"""A small reverse proxy: paths that begin with a prefix are forwarded to one server, all others to another."""

import contextlib
import http.client
import http.server
import threading
from collections.abc import Iterator

CHUNK = 65536
HOP_BY_HOP = {"connection", "keep-alive", "transfer-encoding"}


class _Handler(http.server.BaseHTTPRequestHandler):
    prefix: str
    targets: tuple[str, str]

    def log_message(self, *_):
        """Logs nothing."""

    def _forward(self) -> None:
        with contextlib.suppress(OSError):
            body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
            special, usual = self.targets
            connection = http.client.HTTPConnection(special if self.path.startswith(self.prefix) else usual)
            headers = {name: value for name, value in self.headers.items() if name.lower() not in HOP_BY_HOP}
            connection.request(self.command, self.path, body or None, headers)
            answer = connection.getresponse()
            self.send_response(answer.status)
            for name, value in answer.getheaders():
                if name.lower() not in HOP_BY_HOP:
                    self.send_header(name, value)
            self.end_headers()
            while chunk := answer.read1(CHUNK):
                self.wfile.write(chunk)
                self.wfile.flush()

    do_GET = do_POST = do_PUT = do_DELETE = _forward  # noqa: N815


@contextlib.contextmanager
def reverse_proxy(prefix: str, special: str, usual: str) -> Iterator[str]:
    """Yields the address of a proxy: `prefix…` is forwarded to the address `special`, all else to `usual`."""
    handler = type("Handler", (_Handler,), {"prefix": prefix, "targets": (special, usual)})
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        server.server_close()
