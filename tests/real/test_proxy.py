"""The page behind Caddy, configured as docs/web-page.md describes."""

import hashlib
import re
import tempfile
import unittest
import urllib.error
import urllib.request
from pathlib import Path

from harness.places import ROOT
from harness.processes import free_ports, running
from support.lookdown import lookdown

KEY = "a key that only this test knows"
PAGE = ROOT / "docs" / "web-page.md"


class BehindCaddy(unittest.TestCase):
    """A server behind the documented proxy."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def proxy(self, server: str) -> str:
        """Starts Caddy with the documented file, and returns its address."""
        (recipe,) = re.findall(r"```caddyfile\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
        (port,) = free_ports(1)
        recipe = recipe.replace("127.0.0.1:8080", server)
        recipe = recipe.replace("lookdown.example {", f"http://lookdown.example:{port} {{", 1)
        # A site of the test itself shows that Caddy is ready.
        recipe = "{\n\tadmin off\n}\n" + recipe + f"http://127.0.0.1:{port} {{\n\trespond 200\n}}\n"
        file = self.folder / "Caddyfile"
        file.write_text(recipe, encoding="utf-8")
        command = ["caddy", "run", "--config", str(file), "--adapter", "caddyfile"]
        self.enterContext(running("caddy", command, port, "/", {"HOME": str(self.folder)}, self.folder))
        return f"127.0.0.1:{port}"

    def test_clients_with_a_key_read_the_page_and_results(self):
        keys = self.folder / "keys.toml"
        digest = hashlib.sha256(KEY.encode()).hexdigest()
        keys.write_text(f'page = {{ scopes = ["detect", "read"], sha256 = "{digest}" }}\n', encoding="utf-8")
        server = self.enterContext(lookdown({"ACCESS__KEYS_FILE": str(keys)}))
        proxy = self.proxy(server.address)
        for path in ("/", "/assets/options.json"):
            self.assertEqual(status(proxy, path), 200, path)
        self.assertEqual(status(proxy, "/results"), 401)
        self.assertEqual(status(proxy, "/results", {"X-API-Key": KEY}), 200)

    def test_an_open_server_answers_to_the_name_of_its_proxy(self):
        server = self.enterContext(lookdown({"ACCESS__OPEN": "true", "ACCESS__HOSTS": "lookdown.example"}))
        proxy = self.proxy(server.address)
        self.assertEqual(status(proxy, "/results"), 200)

    def test_a_server_without_keys_refuses_the_clients_of_a_proxy(self):
        server = self.enterContext(lookdown({}))
        proxy = self.proxy(server.address)
        self.assertEqual(status(proxy, "/results"), 403)


def status(address: str, path: str, headers: dict[str, str] | None = None) -> int:
    """The status of a path; 0 while nothing listens."""
    request = urllib.request.Request(f"http://{address}{path}", headers=(headers or {}) | {"Host": host(address)})
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        error.close()
        return error.code
    except OSError:
        return 0


def host(address: str) -> str:
    """The name of the proxied site, with the port of an address."""
    return f"lookdown.example:{address.partition(':')[2]}"


if __name__ == "__main__":
    unittest.main()
