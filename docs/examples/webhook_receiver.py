"""Prints webhooks whose signature is right: webhook_receiver.py SECRET_FILE [PORT]. Needs nothing but Python."""

import base64
import hashlib
import hmac
import http.server
import sys
import time
from pathlib import Path

SECRET = base64.b64decode(Path(sys.argv[1]).read_text(encoding="utf-8").strip().removeprefix("whsec_"))
# A message with an image has some hundred kilobytes.
MAX_BYTES = 16 << 20
MAX_AGE_SECONDS = 300


class Receiver(http.server.BaseHTTPRequestHandler):
    timeout = 30

    def do_POST(self) -> None:
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > MAX_BYTES:
            self.send_error(413)
            return
        body = self.rfile.read(int(length))
        sent = self.headers.get("webhook-timestamp", "0")
        signed = f"{self.headers.get('webhook-id')}.{sent}.".encode() + body
        signature = "v1," + base64.b64encode(hmac.digest(SECRET, signed, hashlib.sha256)).decode()
        given = self.headers.get("webhook-signature", "").split()
        is_right = any(hmac.compare_digest(signature.encode(), one.encode()) for one in given)
        is_recent = sent.isdecimal() and abs(time.time() - int(sent)) < MAX_AGE_SECONDS
        self.send_response(204 if is_right and is_recent else 401)
        self.end_headers()
        if is_right and is_recent:
            print(body.decode(), flush=True)


port = int(sys.argv[2]) if len(sys.argv) > 2 else 8000
http.server.ThreadingHTTPServer(("127.0.0.1", port), Receiver).serve_forever()
