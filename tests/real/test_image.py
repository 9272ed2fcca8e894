"""The container image: built from its Dockerfile, and run like a container engine would."""

import json
import os
import re
import shutil
import stat
import subprocess
import tempfile
import time
import tomllib
import unittest
from fnmatch import fnmatch
from pathlib import Path

from cameras import rtsp_camera
from compose_file import environment, services
from harness.places import LOOKDOWN, ROOT, SAMPLES
from harness.processes import free_ports, running
from image.build import build, remove
from state import wait_until

LARGEST_BYTES = {"serve": 80_000_000, "run": 380_000_000}
"""Without the binary, which takes 37 MB, and 65 MB with the profile `quick`."""
PACKAGES = ("libc6", "libgcc-s1", "libstdc++6", "ca-certificates")
PROGRAM = "/opt/lookdown/lookdown"


class ContainerImage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.addClassCleanup(remove)
        started = time.monotonic()
        cls.image, cls.run_image = build("serve", "run")
        sizes = " and ".join(f"{image.size() / 1e6:.1f} MB" for image in (cls.image, cls.run_image))
        print(f"images: {sizes}, built in {time.monotonic() - started:.0f} s", flush=True)

    def test_its_configuration_describes_how_to_run_it(self):
        config = self.image.config
        self.assertEqual((config["User"], config["WorkingDir"]), ("65532:65532", "/opt/lookdown"))
        self.assertEqual((config["Entrypoint"], config["Cmd"]), ([PROGRAM], ["serve"]))
        self.assertEqual(config["Healthcheck"]["Test"], ["CMD", PROGRAM, "health"])
        self.assertEqual({*config["ExposedPorts"]}, {"8080/tcp", "9090/tcp"})

    def test_its_labels_describe_where_it_comes_from(self):
        prefix = "org.opencontainers.image."
        labels = self.image.config["Labels"].items()
        labels = {name.removeprefix(prefix): value for name, value in labels if name.startswith(prefix)}
        self.assertEqual((labels["revision"], labels["created"]), ("0123456789ab", "2026-11-22T12:00:00Z"))
        for name in ("source", "url", "documentation"):
            self.assertTrue(labels[name].startswith("https://forge.example/lookdown"), name)
        for name in ("title", "description", "version", "vendor", "licenses", "base.name"):
            self.assertTrue(labels[name], name)

    def test_it_is_small_and_has_no_other_program(self):
        for image, name, expected in (
            (self.image, "serve", {"lookdown"}),
            (self.run_image, "run", {"lookdown", "ffmpeg", "ffprobe"}),
        ):
            self.assertLess(image.size() - LOOKDOWN.stat().st_size, LARGEST_BYTES[name])
            files = [file for file in image.root.rglob("*") if file.is_file() and os.access(file, os.X_OK)]
            programs = {file.name for file in files if not file.name.startswith(("lib", "ld-"))}
            self.assertEqual(programs, expected)
            writable = [file for file in image.root.rglob("*") if self.is_writable_by_the_user(file)]
            self.assertEqual(
                {str(file.relative_to(image.root)) for file in writable},
                {"tmp", "opt/lookdown/calibrations", "var/lib/lookdown"},
            )

    def test_third_party_software_has_its_licences(self):
        for image, packages in ((self.image, PACKAGES), (self.run_image, (*PACKAGES, "ffmpeg", "libavcodec59"))):
            for name in packages:
                self.assertTrue((image.root / "usr/share/doc" / name / "copyright").is_file(), name)
                self.assertTrue((image.root / "var/lib/dpkg/status.d" / name).is_file(), name)
        for name in ("LICENSE", "NOTICE", "runtime/LICENSE", "runtime/ThirdPartyNotices.txt", "lookdown.cdx.json"):
            self.assertTrue((self.image.root / "opt/lookdown" / name).is_file(), name)

    def test_all_sources_of_the_program_are_copied(self):
        # Cargo lists the files that the binary was compiled from, including embedded ones.
        listed = LOOKDOWN.with_suffix(".d").read_text(encoding="utf-8").split(":", 1)[1].split()
        sources = {str(Path(file).relative_to(ROOT)) for file in listed if "/target/" not in file}
        self.assertIn("src/main.rs", sources)
        dockerfile = (ROOT / "docker" / "Dockerfile").read_text(encoding="utf-8")
        copied = set(re.findall(r"^COPY (\w+) \1$", dockerfile, re.MULTILINE))
        self.assertEqual({source for source in sources if source.split("/")[0] not in copied}, set())
        ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
        let_in = [line.removeprefix("!") for line in ignored if line.startswith("!")]
        for source in sources:
            parts = [source, *map(str, Path(source).parents)]
            self.assertTrue(any(fnmatch(part, pattern) for part in parts for pattern in let_in), source)

    def test_each_member_of_the_workspace_is_copied(self):
        # Cargo reads the manifests of all members, also of those that it does not build.
        members = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["members"]
        dockerfile = (ROOT / "docker" / "Dockerfile").read_text(encoding="utf-8")
        copied = re.findall(r"^COPY (\S+) \1$", dockerfile, re.MULTILINE)
        for member in members:
            self.assertIn(member.removesuffix("/*"), copied)

    def test_it_serves_read_only_and_its_health_check_works(self):
        (port,) = free_ports(1)
        variables = {"LOOKDOWN__SERVER__LISTEN": f"0.0.0.0:{port}", "LOOKDOWN__SHUTDOWN__GRACE_MILLIS": "0"}
        self.assertEqual(self.health(variables).returncode, 1)
        config = self.image.config
        command = self.image.inside(*config["Entrypoint"], *config["Cmd"], **variables)
        with running("image", command, port, "/readyz", {}) as server:
            print(f"image: ready after {server.seconds_to_ready:.2f} s", flush=True)
            report = json.loads(server.post("/detect?profile=fast", (SAMPLES / "office.jpg").read_bytes()))
            self.assertGreater(len(report["persons"]), 3)
            healthy = self.health(variables)
            self.assertEqual(healthy.returncode, 0, healthy.stderr)
            server.process.terminate()
            self.assertEqual(server.process.wait(30), 0)
        self.assertEqual(self.health(variables).returncode, 1)

    def test_one_variable_shows_the_camera_and_its_counts(self):
        volume = Path(self.enterContext(tempfile.TemporaryDirectory()))
        os.chown(volume, self.run_image.user(), -1)
        frames = Path(self.enterContext(tempfile.TemporaryDirectory()))
        shutil.copy(SAMPLES / "office.jpg", frames / "0.jpg")
        camera = self.enterContext(rtsp_camera(frames, 5))
        service = services(LOOKDOWN_CAMERA=f"rtsp://127.0.0.1:{camera}/stream")["lookdown"]
        for _ in ("first start", "second start, with the same volume"):
            (port,) = free_ports(1)
            own = {"LOOKDOWN__SERVER__LISTEN": f"0.0.0.0:{port}", "LOOKDOWN__SHUTDOWN__GRACE_MILLIS": "0"}
            variables = environment(service) | own | {"VOLUME": str(volume)}
            config = self.run_image.config
            self.assertEqual(config["Cmd"], service["command"])
            command = self.run_image.inside(*config["Entrypoint"], *service["command"], **variables)
            with running("image-run", command, port, "/readyz", {}) as server:
                self.assertIn(b"<title>Lookdown</title>", server.get("/"))

                def cameras(server=server) -> list:
                    return json.loads(server.get("/counts"))

                wait_until(cameras, "the camera is counted", 60)
                self.assertEqual([counted["name"] for counted in cameras()], ["camera"])
                (shown,) = json.loads(server.get("/cameras"))
                self.assertEqual((shown["name"], shown["problem"]), ("camera", None))
                wait_until(lambda server=server: json.loads(server.get("/results")), "a frame is detected", 60)
                report = json.loads(server.get("/results/camera/latest"))
                self.assertGreater(len(report["persons"]), 3)
                server.process.terminate()
                self.assertEqual(server.process.wait(60), 0)
            self.assertTrue((volume / "counts.sqlite").is_file())

    def health(self, variables: dict[str, str]) -> subprocess.CompletedProcess:
        """The result of the image's health check with these variables."""
        check = self.image.config["Healthcheck"]["Test"][1:]
        command = self.image.inside(*check, **variables)
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=10)

    @staticmethod
    def is_writable_by_the_user(file) -> bool:
        found = file.lstat()
        by_all = found.st_mode & stat.S_IWOTH and not stat.S_ISLNK(found.st_mode)
        return bool(by_all) or found.st_uid == 65532


if __name__ == "__main__":
    unittest.main()
