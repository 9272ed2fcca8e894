"""The bill of materials is complete, consistent, and has the source of each component."""

import json
import tomllib
import unittest

from assets.machine import supported_cpu
from assets.runtime import pinned_runtime, sha256_of
from sbom import MODELS, ROOT, bill_of_materials, cargo_metadata, licenses, needed_crates, purl


class ShippedBill(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cpu = supported_cpu()
        cls.metadata = cargo_metadata(ROOT, cls.cpu)
        cls.bill = bill_of_materials(ROOT, cls.cpu, cls.metadata)
        cls.components = {part["bom-ref"]: part for part in cls.bill["components"]}

    def test_it_has_what_cyclonedx_requires(self):
        head = (self.bill["bomFormat"], self.bill["specVersion"], self.bill["version"])
        self.assertEqual(head, ("CycloneDX", "1.6", 1))
        self.assertRegex(self.bill["serialNumber"], r"^urn:uuid:[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$")
        for part in [self.bill["metadata"]["component"], *self.bill["components"]]:
            self.assertIn(part["type"], ("application", "library", "machine-learning-model"))
            self.assertTrue(part["name"] and part["version"] and part["licenses"], part)

    def test_its_application_is_this_version_of_lookdown(self):
        manifest = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
        own = self.bill["metadata"]["component"]
        self.assertEqual((own["name"], own["version"]), ("lookdown", manifest["version"]))
        self.assertEqual(own["licenses"], [{"expression": manifest["license"]}])

    def test_no_name_is_given_twice_and_every_dependency_is_a_part(self):
        self.assertEqual(len(self.components), len(self.bill["components"]))
        entries = self.bill["dependencies"]
        known = {*self.components, self.bill["metadata"]["component"]["bom-ref"]}
        self.assertLessEqual({entry["ref"] for entry in entries}, known)
        self.assertEqual({needed for entry in entries for needed in entry["dependsOn"]}, {*self.components})

    def test_every_component_from_elsewhere_has_a_sum_and_a_purl(self):
        own = {f"pkg:cargo/{folder.name}@" for folder in (ROOT / "crates").iterdir()}
        for reference, part in self.components.items():
            if reference.startswith(tuple(own)):
                continue
            self.assertRegex(part["hashes"][0]["content"], r"^[0-9a-f]{64}$")
            if part["type"] == "library":
                self.assertEqual(part["purl"], reference)

    def test_sbom_has_build_but_no_test_dependencies(self):
        names = {part["name"] for part in self.bill["components"]}
        self.assertLessEqual({"axum", "ort", "rustls", "ring", "utoipa-swagger-ui-vendored"}, names)
        self.assertEqual({"proptest", "insta", "rcgen"} & names, set())

    def test_the_runtime_and_our_networks_have_their_sums(self):
        runtime = pinned_runtime(self.cpu)
        library = self.components[f"pkg:pypi/onnxruntime@{runtime.version}"]
        self.assertEqual(library["hashes"][0]["content"], runtime.sha256)
        for name in MODELS:
            part = self.components[f"model:{name}"]
            self.assertEqual(part["hashes"][0]["content"], sha256_of(ROOT / "models" / name / "model.onnx"))

    def test_the_same_sources_give_the_same_bytes(self):
        again = bill_of_materials(ROOT, self.cpu, cargo_metadata(ROOT, self.cpu))
        self.assertEqual(json.dumps(again), json.dumps(self.bill))


class Parts(unittest.TestCase):
    def test_dev_dependencies_are_omitted_recursively(self):
        def need(name, kind):
            return {"pkg": name, "dep_kinds": [{"kind": kind}]}

        nodes = [
            {"id": "own", "deps": [need("used", None), need("tests", "dev"), need("build", "build")]},
            {"id": "used", "deps": []},
            {"id": "build", "deps": [need("used", None)]},
            {"id": "tests", "deps": [need("more", None)]},
            {"id": "more", "deps": []},
        ]
        needs = needed_crates({"resolve": {"root": "own", "nodes": nodes}})
        self.assertEqual(needs, {"own": {"used", "build"}, "used": set(), "build": {"used"}})

    def test_unstated_licence_is_no_spdx_expression(self):
        self.assertEqual(licenses("MIT OR Apache-2.0"), [{"expression": "MIT OR Apache-2.0"}])
        self.assertEqual(licenses("NOASSERTION"), [{"license": {"name": "not stated"}}])

    def test_what_has_a_meaning_in_a_package_name_is_encoded(self):
        self.assertEqual(purl("npm", "@vladmandic/human", "3.3.6"), "pkg:npm/%40vladmandic/human@3.3.6")
        self.assertEqual(purl("cargo", "toml", "1.2.1+spec-1.1.0"), "pkg:cargo/toml@1.2.1%2Bspec-1.1.0")


if __name__ == "__main__":
    unittest.main()
