"""docker/compose.yaml: the server accepts its settings, and its services are consistent."""

import os
import tomllib
import unittest
from pathlib import Path

from commands import run
from compose_file import DOCKER, environment, services
from harness.places import LOOKDOWN, ROOT
from harness.processes import free_ports
from kubernetes.tools import read_yaml


class ComposeFile(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.services = services()

    def test_the_server_could_start_with_the_settings(self):
        lookdown = self.services["lookdown"]
        self.assertEqual((lookdown["command"], lookdown["volumes"]), (["run"], ["state:/var/lib/lookdown:rw"]))
        (port,) = free_ports(1)
        here = {"LOOKDOWN__SERVER__LISTEN": f"127.0.0.1:{port}"}
        run(LOOKDOWN, "serve", "--check", environment=os.environ | environment(lookdown) | here)

    def test_one_variable_is_the_camera(self):
        self.assertEqual(environment(self.services["lookdown"])["LOOKDOWN_CAMERA"], "")
        source = "rtsp://viewer:s$cret@10.0.0.8/stream?channel=1&sub=2"
        given = services(LOOKDOWN_CAMERA=source)["lookdown"]
        self.assertEqual(environment(given)["LOOKDOWN_CAMERA"], source)

    def test_all_mounted_files_exist(self):
        for name, service in self.services.items():
            for volume in service.get("volumes", []):
                source = volume.split(":")[0]
                if source.startswith("/"):
                    self.assertTrue(Path(source).exists(), f"{name}: {source}")

    def test_services_without_a_key_listen_on_this_machine_only(self):
        for name, service in self.services.items():
            for port in service.get("ports", []):
                self.assertTrue(port.startswith("127.0.0.1:"), f"{name}: {port}")

    def test_monitoring_is_a_profile(self):
        profiles = {name: service.get("profiles", []) for name, service in self.services.items()}
        monitoring = ["monitoring"]
        self.assertEqual(profiles, {"lookdown": [], "prometheus": monitoring, "grafana": monitoring})

    def test_prometheus_scrapes_lookdown_and_grafana_queries_it(self):
        (job,) = read_yaml(DOCKER / "prometheus.yaml")["scrape_configs"]
        self.assertEqual((job["job_name"], job["static_configs"]), ("lookdown", [{"targets": ["lookdown:9090"]}]))
        (source,) = read_yaml(DOCKER / "grafana" / "datasource.yaml")["datasources"]
        self.assertEqual(source["url"], "http://prometheus:9090")
        (provider,) = read_yaml(DOCKER / "grafana" / "dashboards.yaml")["providers"]
        mounted = [volume.split(":")[1] for volume in self.services["grafana"]["volumes"]]
        for name in ("dashboard", "occupancy", "counts"):
            self.assertIn(f"{provider['options']['path']}/{name}.json", mounted)

    def test_the_stop_timeout_covers_the_shutdown_of_the_server(self):
        defaults = tomllib.loads((ROOT / "packaging" / "lookdown.toml").read_text(encoding="utf-8"))
        millis = defaults["shutdown"]["grace_millis"] + defaults["server"]["request_timeout_millis"]
        given = self.services["lookdown"]["stop_grace_period"].removesuffix("s")
        self.assertGreater(int(given), millis / 1000)


if __name__ == "__main__":
    unittest.main()
