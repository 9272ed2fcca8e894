"""Files that contain a version contain that of the crate."""

import re
import tomllib
import unittest

from assets.runtime import pinned_runtime
from dist import ROOT

OWN = ("docker/Dockerfile", "docker/Dockerfile.cuda", "docker/compose.yaml", "k8s/base/kustomization.yaml")
STATED = re.compile(r"(?:lookdown(?:-cuda)?:|image\.version=\"|newTag: |kubernetes\.io/version: )(\d[\w.-]*)")


class OneVersion(unittest.TestCase):
    def test_images_have_the_version_of_the_crate(self):
        manifest = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
        for name in (*OWN, "README.md", "docs/deployment.md"):
            stated = STATED.findall((ROOT / name).read_text(encoding="utf-8"))
            self.assertEqual({*stated}, {manifest["version"]}, name)

    def test_the_image_for_gpus_has_the_onnx_runtime_of_the_other(self):
        text = (ROOT / "docker" / "Dockerfile.cuda").read_text(encoding="utf-8")
        versions = {pinned_runtime("x86_64").version}
        self.assertEqual({*re.findall(r"onnxruntime-gpu==([\d.]+)", text)}, versions)
        self.assertEqual({*re.findall(r"libonnxruntime\.so\.([\d.]+\d)", text)}, versions)


if __name__ == "__main__":
    unittest.main()
