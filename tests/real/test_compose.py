"""docker/compose.yaml: the server accepts its settings, and its services are consistent."""

import os
import subprocess
import tomllib
import unittest

from harness.places import LOOKDOWN, ROOT
from harness.processes import free_ports
from kubernetes.tools import read_yaml

DOCKER = ROOT / "docker"


class ComposeFile(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.services = read_yaml(DOCKER / "compose.yaml")["services"]

    def test_the_server_could_start_with_the_settings(self):
        lookdown = self.services["lookdown"]
        (port,) = free_ports(1)
        (mounted,) = lookdown["volumes"]
        source, target, _ = mounted.split(":")
        self.assertEqual(lookdown["environment"]["LOOKDOWN__CALIBRATIONS__PATH"], target)
        here = {
            "LOOKDOWN__SERVER__LISTEN": f"127.0.0.1:{port}",
            "LOOKDOWN__CALIBRATIONS__PATH": str((DOCKER / source).resolve()),
        }
        environment = os.environ | lookdown["environment"] | here
        check = [LOOKDOWN, "serve", "--check"]
        checked = subprocess.run(check, env=environment, capture_output=True, text=True, check=False)
        self.assertEqual(checked.returncode, 0, checked.stderr)

    def test_all_mounted_files_exist(self):
        for name, service in self.services.items():
            for volume in service.get("volumes", []):
                source = volume.split(":")[0]
                if source.startswith("."):
                    self.assertTrue((DOCKER / source).exists(), f"{name}: {source}")

    def test_services_without_a_key_listen_on_this_machine_only(self):
        for name, service in self.services.items():
            for port in service.get("ports", []):
                self.assertTrue(port.startswith("127.0.0.1:"), f"{name}: {port}")

    def test_prometheus_scrapes_lookdown_and_grafana_queries_it(self):
        (job,) = read_yaml(DOCKER / "prometheus.yaml")["scrape_configs"]
        self.assertEqual((job["job_name"], job["static_configs"]), ("lookdown", [{"targets": ["lookdown:8080"]}]))
        (source,) = read_yaml(DOCKER / "grafana" / "datasource.yaml")["datasources"]
        self.assertEqual(source["url"], "http://prometheus:9090")
        (provider,) = read_yaml(DOCKER / "grafana" / "dashboards.yaml")["providers"]
        mounted = [volume.split(":")[1] for volume in self.services["grafana"]["volumes"]]
        self.assertIn(f"{provider['options']['path']}/dashboard.json", mounted)

    def test_the_stop_timeout_covers_the_shutdown_of_the_server(self):
        defaults = tomllib.loads((ROOT / "config" / "lookdown.toml").read_text(encoding="utf-8"))
        millis = defaults["shutdown"]["grace_millis"] + defaults["server"]["request_timeout_millis"]
        given = self.services["lookdown"]["stop_grace_period"].removesuffix("s")
        self.assertGreater(int(given), millis / 1000)


if __name__ == "__main__":
    unittest.main()
