"""Inference with OpenVINO, by the ONNX Runtime of the package `onnxruntime-openvino` from PyPI."""

import json
import os
import subprocess
import unittest

from harness.places import LOOKDOWN, ROOT, SAMPLES, model
from remote_inference import MODEL, assert_same

PACKAGES = ROOT / ".setup" / "real" / "openvino" / "lib"
HERE = {"MODEL__PATH": str(model(MODEL).parent)}


def device(name: str) -> dict[str, str]:
    """Settings that run networks on a device of OpenVINO."""
    (library,) = PACKAGES.glob("python*/site-packages/onnxruntime/capi/libonnxruntime.so.*")
    return HERE | {"INFERENCE__DEVICE": f"openvino:{name}", "INFERENCE__LIBRARY_PATH": str(library)}


def detect(settings: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """The outcome of `lookdown detect` of a sample."""
    flags = ["--calibration", str(SAMPLES / "calibrations" / "office.json"), "--profile", "fast"]
    environment = {f"LOOKDOWN__{name}": value for name, value in settings.items()}
    return subprocess.run(
        [str(LOOKDOWN), "detect", str(SAMPLES / "office.jpg"), *flags],
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | environment,
        check=False,
    )


class OpenVino(unittest.TestCase):
    """The processor is the one device of OpenVINO that every machine has."""

    def test_the_processor_detects_the_same_persons(self) -> None:
        alone, with_open_vino = detect(HERE), detect(device("cpu"))
        self.assertEqual(with_open_vino.returncode, 0, with_open_vino.stderr)
        assert_same(self, json.loads(with_open_vino.stdout), json.loads(alone.stdout))

    def test_a_missing_device_is_named_with_a_remedy(self) -> None:
        for name in ("gpu", "npu"):
            with self.subTest(name):
                refused = detect(device(name))
                self.assertNotEqual(refused.returncode, 0)
                self.assertIn(f"inference.device: openvino:{name} cannot be used: ", refused.stderr)
                self.assertIn("check that this machine has the device, and its driver, or use cpu", refused.stderr)


if __name__ == "__main__":
    unittest.main()
