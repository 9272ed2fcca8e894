"""The manifests of k8s: valid, and consistent with each other and with the server."""

import os
import tomllib
import unittest

from commands import CommandFailed, run
from harness.places import LOOKDOWN, ROOT
from harness.processes import free_ports
from kubernetes.tools import PYTHON, VALIDATE, kustomized, manifests, only, read_yaml

OVERLAYS = (
    *("overlays/cpu", "overlays/gpu", "overlays/ha", "overlays/keda", "overlays/run"),
    *("examples/gateway", "examples/ingress"),
)
# The overlays whose number of pods is fixed.
UNSCALED = ("base", "overlays/gpu", "overlays/run")


class Manifests(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.all = {folder: manifests(folder) for folder in ("base", *OVERLAYS)}

    def test_services_budgets_and_policies_select_the_pods(self):
        for documents in self.all.values():
            deployment = only(documents, "Deployment")["spec"]
            labels = deployment["template"]["metadata"]["labels"]
            self.assertLessEqual(deployment["selector"]["matchLabels"].items(), labels.items())
            self.assertLessEqual(only(documents, "Service")["spec"]["selector"].items(), labels.items())
            budget = only(documents, "PodDisruptionBudget")["spec"]["selector"]["matchLabels"]
            self.assertLessEqual(budget.items(), labels.items())
            for policy in (document["spec"] for document in documents if document["kind"] == "NetworkPolicy"):
                self.assertLessEqual(policy["podSelector"]["matchLabels"].items(), labels.items())
            for constraint in deployment["template"]["spec"]["topologySpreadConstraints"]:
                self.assertLessEqual(constraint["labelSelector"]["matchLabels"].items(), labels.items())

    def test_ports_have_consistent_names_and_numbers(self):
        for documents in self.all.values():
            settings = self.settings(documents)
            container = self.container(documents)
            ports = {port["name"]: port["containerPort"] for port in container["ports"]}
            self.assertEqual(settings["LOOKDOWN__SERVER__LISTEN"], f"0.0.0.0:{ports['http']}")
            self.assertEqual(settings["LOOKDOWN__SERVER__METRICS_LISTEN"], f"0.0.0.0:{ports['metrics']}")
            self.assertEqual({port["targetPort"] for port in only(documents, "Service")["spec"]["ports"]}, {*ports})
            for probe, path in (("startup", "/livez"), ("liveness", "/livez"), ("readiness", "/readyz")):
                self.assertEqual(container[f"{probe}Probe"]["httpGet"], {"path": path, "port": "metrics"})

    def test_the_termination_period_covers_the_shutdown(self):
        defaults = tomllib.loads((ROOT / "packaging" / "lookdown.toml").read_text(encoding="utf-8"))
        millis = defaults["shutdown"]["grace_millis"] + defaults["server"]["request_timeout_millis"]
        for documents in self.all.values():
            pod = only(documents, "Deployment")["spec"]["template"]["spec"]
            before = self.container(documents)["lifecycle"]["preStop"]["sleep"]["seconds"]
            self.assertGreater(pod["terminationGracePeriodSeconds"], before + millis / 1000)

    def test_a_pod_has_minimal_privileges(self):
        for documents in self.all.values():
            pod = only(documents, "Deployment")["spec"]["template"]["spec"]
            self.assertEqual((pod["automountServiceAccountToken"], pod["enableServiceLinks"]), (False, False))
            self.assertEqual(pod["securityContext"]["seccompProfile"], {"type": "RuntimeDefault"})
            self.assertTrue(pod["securityContext"]["runAsNonRoot"])
            may = self.container(documents)["securityContext"]
            self.assertEqual((may["readOnlyRootFilesystem"], may["allowPrivilegeEscalation"]), (True, False))
            self.assertEqual(may["capabilities"], {"drop": ["ALL"]})

    def test_the_server_could_start_with_the_settings(self):
        for folder, documents in self.all.items():
            mount, calibrations = self.container(documents)["volumeMounts"][0], ROOT / "k8s" / "base" / "calibrations"
            settings = self.settings(documents)
            self.assertEqual(settings["LOOKDOWN__CALIBRATIONS__PATH"], mount["mountPath"])
            first, second = free_ports(2)
            here = {
                "LOOKDOWN__SERVER__LISTEN": f"127.0.0.1:{first}",
                "LOOKDOWN__SERVER__METRICS_LISTEN": f"127.0.0.1:{second}",
                "LOOKDOWN__CALIBRATIONS__PATH": str(calibrations),
                # The settings can be checked without a GPU.
                "LOOKDOWN__INFERENCE__DEVICE": "cpu",
            }
            environment = os.environ | settings | here
            with self.subTest(folder):
                said = run(LOOKDOWN, "serve", "--check", environment=environment)
                self.assertIn("1 calibrations can be used", said)

    def test_one_pod_runs_all_parts_with_its_state_in_a_volume(self):
        documents = self.all["overlays/run"]
        deployment, container = only(documents, "Deployment")["spec"], self.container(documents)
        self.assertEqual((deployment["replicas"], deployment["strategy"]), (1, {"type": "Recreate"}))
        self.assertEqual(container["args"], ["run"])
        mounts = {mount["mountPath"]: mount["name"] for mount in container["volumeMounts"]}
        volumes = {volume["name"]: volume for volume in deployment["template"]["spec"]["volumes"]}
        claim = volumes[mounts["/var/lib/lookdown"]]["persistentVolumeClaim"]["claimName"]
        self.assertEqual(claim, only(documents, "PersistentVolumeClaim")["metadata"]["name"])
        for folder in set(OVERLAYS) - {"overlays/run"}:
            self.assertEqual(self.container(self.all[folder])["args"], ["serve"], folder)

    def test_the_autoscaler_uses_the_metric_of_the_adapter(self):
        (rule,) = read_yaml(ROOT / "k8s" / "monitoring" / "prometheus-adapter.yaml")["rules"]
        metrics = only(self.all["overlays/ha"], "HorizontalPodAutoscaler")["spec"]["metrics"]
        asked = [metric["pods"]["metric"]["name"] for metric in metrics if metric["type"] == "Pods"]
        self.assertEqual(asked, [rule["name"]["as"]])

    def test_only_one_autoscaler_scales_the_deployment(self):
        for folder, documents in self.all.items():
            kinds = ("HorizontalPodAutoscaler", "ScaledObject")
            found = [document["kind"] for document in documents if document["kind"] in kinds]
            self.assertEqual(len(found), 0 if folder in UNSCALED else 1, f"{folder}: {found}")
        scaled = only(self.all["overlays/keda"], "ScaledObject")["spec"]
        autoscaler = only(self.all["overlays/ha"], "HorizontalPodAutoscaler")["spec"]
        self.assertEqual(scaled["scaleTargetRef"]["name"], autoscaler["scaleTargetRef"]["name"])
        limits = (scaled["minReplicaCount"], scaled["maxReplicaCount"])
        self.assertEqual(limits, (autoscaler["minReplicas"], autoscaler["maxReplicas"]))

    def test_routes_lead_to_the_service(self):
        service = only(self.all["base"], "Service")
        ports = {port["name"]: port["port"] for port in service["spec"]["ports"]}
        (rule,) = only(self.all["examples/ingress"], "Ingress")["spec"]["rules"]
        (path,) = rule["http"]["paths"]
        name = service["metadata"]["name"]
        self.assertEqual(path["backend"]["service"], {"name": name, "port": {"name": "http"}})
        (rule,) = only(self.all["examples/gateway"], "HTTPRoute")["spec"]["rules"]
        self.assertEqual(rule["backendRefs"], [{"name": name, "port": ports["http"]}])
        for folder in ("examples/ingress", "examples/gateway"):
            policies = [document for document in self.all[folder] if document["kind"] == "NetworkPolicy"]
            self.assertEqual(len(policies), 2, folder)

    def test_kserve_uses_the_runtime(self):
        documents = manifests("examples/kserve")
        runtime, service = only(documents, "ServingRuntime"), only(documents, "InferenceService")
        model = service["spec"]["predictor"]["model"]
        self.assertEqual(model["runtime"], runtime["metadata"]["name"])
        formats = [supported["name"] for supported in runtime["spec"]["supportedModelFormats"]]
        self.assertIn(model["modelFormat"]["name"], formats)
        self.assertIn(model["protocolVersion"], runtime["spec"]["protocolVersions"])
        (container,) = runtime["spec"]["containers"]
        settings = {variable["name"]: variable["value"] for variable in container["env"]}
        (port,) = container["ports"]
        self.assertEqual(settings["LOOKDOWN__SERVER__LISTEN"], f"0.0.0.0:{port['containerPort']}")

    def test_a_field_of_kserve_that_is_misspelled_is_refused(self):
        text = kustomized(ROOT / "k8s" / "examples" / "kserve")
        for right, wrong, problem in (
            ("protocolVersion: v2", "protocol: v2", "'protocol' was unexpected"),
            ("minReplicas: 1", 'minReplicas: "1"', "spec.predictor.minReplicas: '1' is not of type"),
            ("containerPort:", "port:", "ServingRuntime: spec.containers.0.ports.0:"),
        ):
            self.assertIn(right, text)
            with self.assertRaises(CommandFailed) as refused:
                run(PYTHON / "python", VALIDATE, given=text.replace(right, wrong))
            self.assertIn(problem, str(refused.exception))

    @staticmethod
    def container(documents: list[dict]) -> dict:
        (container,) = only(documents, "Deployment")["spec"]["template"]["spec"]["containers"]
        return container

    @staticmethod
    def settings(documents: list[dict]) -> dict[str, str]:
        maps = [document for document in documents if document["kind"] == "ConfigMap"]
        (settings,) = [found["data"] for found in maps if found["metadata"]["name"].startswith("lookdown-settings")]
        return settings


if __name__ == "__main__":
    unittest.main()
