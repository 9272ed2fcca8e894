"""The page and the counts behind Caddy, configured as docs/web-page.md describes."""

import hashlib
import json
import re
import signal
import tempfile
import unittest
import urllib.error
import urllib.request
from pathlib import Path

from harness.places import ROOT
from harness.processes import free_ports, running
from support.lookdown import lookdown
from test_count import Count
from waiting import wait_until

KEY = "a key that only this test knows"
PAGE = ROOT / "docs" / "web-page.md"


class BehindCaddy(unittest.TestCase):
    """A server and `lookdown count` behind the documented proxy."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def proxy(self, server: str, count: str) -> str:
        """Starts Caddy with the documented file, and returns its address."""
        (recipe,) = re.findall(r"```caddyfile\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
        (port,) = free_ports(1)
        recipe = recipe.replace("127.0.0.1:8090", count).replace("127.0.0.1:8080", server)
        recipe = recipe.replace("lookdown.example {", f"http://lookdown.example:{port} {{", 1)
        # A site of the test itself shows that Caddy is ready.
        recipe = "{\n\tadmin off\n}\n" + recipe + f"http://127.0.0.1:{port} {{\n\trespond 200\n}}\n"
        file = self.folder / "Caddyfile"
        file.write_text(recipe, encoding="utf-8")
        command = ["caddy", "run", "--config", str(file), "--adapter", "caddyfile"]
        self.enterContext(running("caddy", command, port, "/", {"HOME": str(self.folder)}, self.folder))
        return f"127.0.0.1:{port}"

    def counting(self, server: str, key_file: Path | None = None) -> str:
        """Starts `lookdown count` and returns its address."""
        (port,) = free_ports(1)
        key = f'api_key_file = "{key_file}"\n' if key_file else ""
        settings = self.folder / "count.toml"
        settings.write_text(
            f'[server]\nurl = "http://{server}"\n{key}[http]\nlisten = "127.0.0.1:{port}"\n{key}'
            f'[store]\npath = "{self.folder / "counts.sqlite"}"\n',
            encoding="utf-8",
        )
        count = Count(settings, self.folder / "count.log", port)
        self.addCleanup(count.stop, signal.SIGKILL)
        wait_until(lambda: status(count.url.removeprefix("http://"), "/livez") == 200, "the counts are served")
        return f"127.0.0.1:{port}"

    def test_clients_with_a_key_read_the_page_results_and_counts(self):
        keys, key_file = self.folder / "keys.toml", self.folder / "key"
        digest = hashlib.sha256(KEY.encode()).hexdigest()
        keys.write_text(f'page = {{ scopes = ["detect", "read"], sha256 = "{digest}" }}\n', encoding="utf-8")
        key_file.write_text(KEY + "\n", encoding="utf-8")
        server = self.enterContext(lookdown({"ACCESS__KEYS_FILE": str(keys), "PAGE__COUNTS_PATH": "/counts"}))
        proxy = self.proxy(server.address, self.counting(server.address, key_file))
        for path in ("/", "/assets/options.json"):
            self.assertEqual(status(proxy, path), 200, path)
        for path in ("/results", "/counts"):
            self.assertEqual(status(proxy, path), 401, path)
            self.assertEqual(status(proxy, path, {"X-API-Key": KEY}), 200, path)
        self.assertEqual(json.loads(body(proxy, "/counts", {"X-API-Key": KEY})), [])

    def test_an_open_server_answers_to_the_name_of_its_proxy(self):
        server = self.enterContext(lookdown({"ACCESS__OPEN": "true", "ACCESS__HOSTS": "lookdown.example"}))
        proxy = self.proxy(server.address, "127.0.0.1:1")
        self.assertEqual(status(proxy, "/results"), 200)

    def test_a_server_without_keys_refuses_the_clients_of_a_proxy(self):
        server = self.enterContext(lookdown({}))
        proxy = self.proxy(server.address, "127.0.0.1:1")
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


def body(address: str, path: str, headers: dict[str, str]) -> bytes:
    """The body of a path."""
    request = urllib.request.Request(f"http://{address}{path}", headers=headers | {"Host": host(address)})
    with urllib.request.urlopen(request, timeout=10) as answer:
        return answer.read()


def host(address: str) -> str:
    """The name of the proxied site, with the port of an address."""
    return f"lookdown.example:{address.partition(':')[2]}"


if __name__ == "__main__":
    unittest.main()
