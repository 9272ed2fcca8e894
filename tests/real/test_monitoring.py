"""Alerts, the dashboard and the autoscaler's metric: valid for Prometheus, and based on metrics that exist."""

import http.client
import json
import re
import shutil
import ssl
import tempfile
import unittest
from pathlib import Path

from cameras import office_calibration
from commands import run
from harness.places import LOOKDOWN, ROOT, SAMPLES, model
from harness.processes import free_ports, running
from kubernetes.tools import kustomized, manifests, only, read_yaml
from state import wait_until
from support.lookdown import lookdown

MONITORING = ROOT / "k8s" / "monitoring"
DASHBOARDS = ("dashboard.json", "occupancy.json", "counts.json")
UNIT_TESTS = Path(__file__).with_name("kubernetes") / "alerts_test.yaml"
SELECTOR = re.compile(r"\b(lookdown_\w+|process_\w+)(?:\{([^}]*)\})?")
MATCHER = re.compile(r'(\w+)="([^"]+)"')
# Labels that Prometheus adds to what it scrapes.
ITS_OWN = ("job", "instance", "namespace", "pod")
# A replica whose frames wait for a quarter of a second, and one without frames.
QUEUES = {
    'lookdown_queue_duration_seconds_sum{job="lookdown", pod="a"}': "0+30x10",
    'lookdown_queue_duration_seconds_count{job="lookdown", pod="a"}': "0+120x10",
    'lookdown_queue_duration_seconds_sum{job="lookdown", pod="b"}': "7x10",
    'lookdown_queue_duration_seconds_count{job="lookdown", pod="b"}': "9x10",
}


class Monitoring(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.documents = manifests("monitoring")
        cls.alerts = only(cls.documents, "PrometheusRule")["spec"]
        cls.rules = [rule for group in cls.alerts["groups"] for rule in group["rules"]]
        dashboards = [json.loads((MONITORING / name).read_text(encoding="utf-8")) for name in DASHBOARDS]
        panels = [panel for dashboard in dashboards for panel in dashboard["panels"]]
        cls.panels = [target["expr"] for panel in panels for target in panel["targets"]]
        cls.keda = only(manifests("overlays/keda"), "ScaledObject")["spec"]["triggers"]
        (cls.adapter,) = read_yaml(MONITORING / "prometheus-adapter.yaml")["rules"]

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        zones = [{"name": "left", "frame_px": [[0, 0], [480, 0], [480, 960], [0, 960]]}]
        lines = [{"name": "middle", "frame_px": [[480, 0], [480, 960]]}]
        self.calibrations = office_calibration(self.folder / "calibrations", zones=zones, lines=lines)

    def test_alerts_fire_only_for_their_causes(self):
        self.write("rules.yaml", self.alerts)
        run("promtool", "check", "rules", self.folder / "rules.yaml")
        bare = [{part: rule[part] for part in rule if part != "annotations"} for rule in self.rules]
        self.write("rules.yaml", {"groups": [{"name": "lookdown", "rules": bare}]})
        shutil.copy(UNIT_TESTS, self.folder)
        run("promtool", "test", "rules", self.folder / UNIT_TESTS.name)
        tested = UNIT_TESTS.read_text(encoding="utf-8")
        self.assertEqual([rule["alert"] for rule in self.rules if f"alertname: {rule['alert']}\n" not in tested], [])

    def test_every_alert_has_a_runbook(self):
        page = (ROOT / "docs" / "observability.md").read_text(encoding="utf-8")
        anchors = {line.strip("# ").lower() for line in page.splitlines() if line.startswith("### Lookdown")}
        runbooks = {rule["annotations"]["runbook_url"] for rule in self.rules}
        self.assertEqual(runbooks, {f"docs/observability.md#{anchor}" for anchor in anchors})

    def test_runbooks_have_the_address_of_the_annotation(self):
        folder = self.folder / "monitoring"
        shutil.copytree(MONITORING, folder)
        alerts, address = folder / "alerts.yaml", "https://help.example/lookdown.html"
        given = alerts.read_text(encoding="utf-8").replace("runbooks: docs/observability.md", f"runbooks: {address}")
        alerts.write_text(given, encoding="utf-8")
        shown = kustomized(folder)
        self.assertEqual(shown.count(f"runbook_url: {address}#lookdown"), len(self.rules))

    def test_prometheus_accepts_the_dashboard(self):
        self.assertTrue(self.panels)
        rules = [
            {"record": f"panel:{number}", "expr": expression.replace("$__rate_interval", "5m")}
            for number, expression in enumerate(self.panels)
        ]
        self.write("panels.yaml", {"groups": [{"name": "panels", "rules": rules}]})
        run("promtool", "check", "rules", self.folder / "panels.yaml")

    def test_the_autoscalers_metric_is_the_mean_queue_time(self):
        query = self.adapter["metricsQuery"].replace("<<.GroupBy>>", "pod").replace("<<.LabelMatchers>>", 'pod=~"a|b"')
        samples = [{"labels": '{pod="a"}', "value": 0.25}, {"labels": '{pod="b"}', "value": 0}]
        self.check_query(query, QUEUES, samples)

    def test_the_query_of_keda_is_the_mean_queue_time(self):
        self.check_query(self.keda_query(), QUEUES, [{"labels": "{}", "value": 0.25}])
        # Without frames it is zero.
        self.check_query(self.keda_query(), dict.fromkeys(QUEUES, "7x10"), [{"labels": "{}", "value": 0}])

    def keda_query(self) -> str:
        """The query of the overlay `keda`."""
        (query,) = [trigger["metadata"]["query"] for trigger in self.keda if trigger["type"] == "prometheus"]
        return query

    def check_query(self, query: str, series: dict[str, str], samples: list[dict]) -> None:
        """Asserts the result of a query after eight minutes of one sample each."""
        test = {
            "interval": "1m",
            "input_series": [{"series": name, "values": values} for name, values in series.items()],
            "promql_expr_test": [{"expr": query, "eval_time": "8m", "exp_samples": samples}],
        }
        self.write("test.yaml", {"tests": [test]})
        run("promtool", "test", "rules", self.folder / "test.yaml")

    def test_every_queried_metric_and_label_is_in_a_scrape(self):
        scrape = self.scrape() + self.scrape_without_the_inference_server() + self.scrape_of_all_parts()
        queries = [rule["expr"] for rule in self.rules] + self.panels
        queries += [self.adapter["seriesQuery"], self.adapter["metricsQuery"], self.keda_query()]
        asked = {found.groups() for query in queries for found in SELECTOR.finditer(query)}
        self.assertGreater(len(asked), 20)
        for name, labels in asked:
            lines = [line for line in scrape.splitlines() if re.match(rf"{name}[{{ ]", line)]
            self.assertTrue(lines, f"{name} is in no scrape")
            for label, value in MATCHER.findall(labels or ""):
                if label not in ITS_OWN and not value.startswith("$"):
                    self.assertTrue(any(f'{label}="{value}"' in line for line in lines), f"{name}: {label}={value}")

    def test_prometheus_accepts_the_settings_for_compose(self):
        run("promtool", "check", "config", ROOT / "docker" / "prometheus.yaml")

    def scrape(self) -> str:
        """The metrics of a server that has answered a frame over TLS."""
        key, certificate = self.folder / "key.pem", self.folder / "certificate.pem"
        key_of = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", key]
        name = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
        run("openssl", "req", "-x509", *key_of, *name, "-out", certificate)
        port, metrics_port = free_ports(2)
        settings = {
            "SERVER__LISTEN": f"127.0.0.1:{port}",
            "SERVER__METRICS_LISTEN": f"127.0.0.1:{metrics_port}",
            "SERVER__TLS__CERTIFICATE": str(certificate),
            "SERVER__TLS__PRIVATE_KEY": str(key),
            "SHUTDOWN__GRACE_MILLIS": "0",
            "CALIBRATIONS__PATH": str(self.calibrations),
            "CALIBRATIONS__ZONE_METRICS": "true",
            "RESULTS__CAMERA_METRICS": "true",
        }
        environment = {f"LOOKDOWN__{name}": value for name, value in settings.items()}
        with running("monitored", [str(LOOKDOWN), "serve"], metrics_port, "/readyz", environment) as server:
            context = ssl.create_default_context(cafile=certificate)
            connection = http.client.HTTPSConnection("localhost", port, timeout=60, context=context)
            connection.request("POST", "/detect?profile=fast&calibration=office", (SAMPLES / "office.jpg").read_bytes())
            self.assertEqual(connection.getresponse().status, 200)
            return server.get("/metrics").decode()

    def scrape_of_all_parts(self) -> str:
        """The metrics of `lookdown run` that has counted a frame of a camera."""
        frames = self.folder / "frames"
        frames.mkdir()
        settings = {
            "COUNTS__PATH": self.folder / "counts.sqlite",
            "COUNTS__FLOOR_ALERT": "true",
            "STATE__PATH": self.folder / "state",
        }
        command = ["run", frames, "--calibration", "office", "--profile", "fast"]
        with lookdown(settings, calibrations=self.calibrations, command=command) as server:
            shutil.copy(SAMPLES / "office.jpg", frames)
            wait_until(lambda: b"lookdown_count_crossings_total{" in server.get("/metrics"), "the frame is counted")
            return server.get("/metrics").decode()

    def scrape_without_the_inference_server(self) -> str:
        """The metrics of a server whose inference server does not answer."""
        (unused,) = free_ports(1)
        settings = {
            "INFERENCE__BACKEND": "v2",
            "INFERENCE__URL": f"http://127.0.0.1:{unused}",
            "INFERENCE__MODEL": "nanodet_g_views_416",
            "MODEL__PATH": model("nanodet_g_views_416").parent,
        }
        with lookdown(settings, probe="/livez") as server:
            wait_until(lambda: b"\nlookdown_remote_up 0\n" in server.get("/metrics"), "the outage is detected")
            return server.get("/metrics").decode()

    def write(self, name: str, content: dict) -> None:
        # JSON is valid YAML.
        (self.folder / name).write_text(json.dumps(content), encoding="utf-8")


if __name__ == "__main__":
    unittest.main()
