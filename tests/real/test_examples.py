"""The examples of the folder `examples` that need no further programs, as users run them."""

import base64
import csv
import hashlib
import hmac
import http.client
import json
import re
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from commands import run
from harness.places import ROOT, SAMPLES
from harness.processes import free_ports
from state import wait_until
from support.lookdown import lookdown
from test_count import OTHER_SECRET, SECRET, CountedCamera

EXAMPLES = ROOT / "docs" / "examples"
OFFICE = SAMPLES / "office.jpg"
METRIC = re.compile(r"\blookdown_\w+")
SERIES = "# TYPE "


class Detect(unittest.TestCase):
    """Examples that send a frame."""

    def test_the_shell_prints_the_report(self) -> None:
        with lookdown({}) as server:
            report = json.loads(run(EXAMPLES / "detect.sh", OFFICE, f"http://{server.address}", "calibration=office"))
        self.assertEqual(report["calibration"]["id"], "office")
        self.assertGreater(len(report["persons"]), 3)

    def test_python_prints_the_persons(self) -> None:
        with lookdown({}) as server:
            lines = run(sys.executable, EXAMPLES / "detect.py", OFFICE, f"http://{server.address}").splitlines()
        self.assertGreater(len(lines), 3)


class Counts(CountedCamera):
    """Examples that use counts."""

    def test_counts_are_a_table_and_the_queries_name_their_metrics(self) -> None:
        settings = self.settings.read_text(encoding="utf-8")
        settings = settings.replace("[counts]", "[counts]\nfloor_alert = true")
        self.settings.write_text(settings, encoding="utf-8")
        with self.counting() as count:
            wait_until(lambda: count.get("/counts") is not None, "lookdown count answers")
            self.send_frames()
            wait_until(lambda: (count.get("/counts/office/tracks") or {}).get("tracks"), "there are tracks")
            table = list(csv.DictReader(run(EXAMPLES / "counts_to_csv.sh", "office", count.url).splitlines()))
            self.assertTrue(any(float(row["known_seconds"]) > 0 for row in table), table)
            scrape = http.client.HTTPConnection("127.0.0.1", self.port, timeout=5)
            scrape.request("GET", "/metrics")
            metrics = scrape.getresponse().read().decode()
        queries = (EXAMPLES / "counts.promql").read_text(encoding="utf-8").split("\n\n")
        panel = json.loads((EXAMPLES / "grafana_panel.json").read_text(encoding="utf-8"))
        queries += [target["expr"] for target in panel["targets"]]
        known = {line.split()[2] for line in metrics.splitlines() if line.startswith(SERIES)}
        self.assertEqual({name for query in queries for name in METRIC.findall(query)} - known, set())
        rules = [{"record": f"example:{number}", "expr": query} for number, query in enumerate(queries)]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "rules.json"
            file.write_text(json.dumps({"groups": [{"name": "examples", "rules": rules}]}), encoding="utf-8")
            run("promtool", "check", "rules", file)

    def test_the_receiver_prints_webhooks_with_the_right_signature(self) -> None:
        (port,) = free_ports(1)
        secret, wrong = self.folder / "hook.secret", self.folder / "wrong.secret"
        secret.write_text(SECRET + "\n", encoding="utf-8")
        wrong.write_text(OTHER_SECRET + "\n", encoding="utf-8")
        hook = '[[webhooks]]\nurl = "http://127.0.0.1:{}/{}"\nsecret_file = "{}"\non = "occupancy"\n'
        with open(self.settings, "a", encoding="utf-8") as settings:
            settings.write(hook.format(port, "right", secret) + hook.format(port, "wrong", wrong))
        printed, log = self.folder / "printed", self.folder / "receiver.log"
        with printed.open("wb") as output, log.open("wb") as errors:
            command = [sys.executable, EXAMPLES / "webhook_receiver.py", secret, str(port)]
            receiver = subprocess.Popen(command, stdout=output, stderr=errors)
            self.addCleanup(receiver.wait, 20)
            self.addCleanup(receiver.kill)
            with self.counting() as count:
                wait_until(lambda: count.get("/counts") is not None, "lookdown count answers")
                self.send_frames()
                wait_until(lambda: b'" 401 ' in log.read_bytes(), "a wrong signature is refused")
                wait_until(lambda: b'" 204 ' in log.read_bytes(), "a right signature is accepted")
        messages = [json.loads(line) for line in printed.read_text(encoding="utf-8").splitlines()]
        self.assertEqual({message["type"] for message in messages}, {"occupancy.reached"})

    def test_the_receiver_takes_a_message_with_an_image(self) -> None:
        (port,) = free_ports(1)
        secret, printed = self.folder / "hook.secret", self.folder / "printed"
        secret.write_text(SECRET + "\n", encoding="utf-8")
        key = base64.b64decode(SECRET.removeprefix("whsec_"))
        body, sent = b"x" * 200_000, str(int(time.time()))
        right = base64.b64encode(hmac.digest(key, f"id.{sent}.".encode() + body, hashlib.sha256)).decode()
        command = [sys.executable, EXAMPLES / "webhook_receiver.py", secret, str(port)]
        with printed.open("wb") as output, subprocess.Popen(command, stdout=output) as receiver:
            self.addCleanup(receiver.kill)
            for signature, status in ((f"v1,{right}", 204), ("v1,\u00e9", 401)):
                headers = {"webhook-id": "id", "webhook-timestamp": sent, "webhook-signature": signature}
                wait_until(lambda: is_open(port), "the receiver listens")
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
                connection.request("POST", "/", body, headers)
                self.assertEqual(connection.getresponse().status, status)
                connection.close()
            receiver.kill()


def is_open(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


if __name__ == "__main__":
    unittest.main()
