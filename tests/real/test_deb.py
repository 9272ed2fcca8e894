"""The Debian package: its checks, and its life in a minimal Debian from installation to purge."""

import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest
import urllib.request
from pathlib import Path

from deb.chroot import UNIT, UNITS, Chroot
from harness.places import LOOKDOWN, ROOT, SAMPLES
from harness.processes import free_ports, running

SCRIPTS = ROOT / "scripts"
LARGEST_EXPOSURE = 2.0
SETTINGS = "etc/lookdown/lookdown.toml"
ENABLED = "etc/systemd/system/multi-user.target.wants/lookdown.service"


class DebianPackage(unittest.TestCase):
    """The package of `make deb`, installed once for all tests but those of its removal."""

    @classmethod
    def setUpClass(cls):
        run([sys.executable, SCRIPTS / "dist.py", LOOKDOWN])
        run([sys.executable, SCRIPTS / "deb.py"])
        (cls.package,) = (ROOT / "target" / "deb").glob("*.deb")
        cls.place = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.chroot = Chroot.create(cls.place / "installed")
        cls.chroot.install(cls.package)
        print(f"\n  package {cls.package.stat().st_size / 1e6:.1f} MB", flush=True)

    def test_lintian_finds_nothing(self):
        self.assertEqual(run(["lintian", "--allow-root", "--fail-on=error,warning", self.package]), "")

    def test_systemd_accepts_the_unit(self):
        chroot = Chroot.create(self.place / "verified")
        chroot.install(self.package)
        # The minimal Debian has no systemd.
        for target in Path("/", UNITS).glob("*.target"):
            shutil.copy(target, chroot.root / UNITS)
        command = ["systemd-analyze", "verify", "--man=no", f"--root={chroot.root}", "lookdown.service"]
        self.assertEqual(run(command), "")

    def test_the_service_is_confined(self):
        root = f"--root={self.chroot.root}"
        threshold = f"--threshold={LARGEST_EXPOSURE * 10:.0f}"
        command = ["systemd-analyze", "security", "--no-pager", "--offline=true", threshold, root, "lookdown.service"]
        print(f"\n  {run(command).strip().splitlines()[-1]}", flush=True)

    def test_the_command_has_manual_pages_and_completions(self):
        installed = self.chroot.run("dpkg", "--listfiles", "lookdown").split()
        for file in (
            "/usr/share/man/man1/lookdown.1.gz",
            "/usr/share/man/man1/lookdown-serve.1.gz",
            "/usr/share/bash-completion/completions/lookdown.bash",
            "/usr/share/zsh/vendor-completions/_lookdown",
            "/usr/share/fish/vendor_completions.d/lookdown.fish",
        ):
            self.assertIn(file, installed)
        self.assertTrue((self.chroot.root / ENABLED).is_symlink())

    def test_the_command_detects_persons(self):
        shutil.copy(SAMPLES / "office.jpg", self.chroot.root / "tmp")
        report = json.loads(self.chroot.run("lookdown", "detect", "/tmp/office.jpg"))
        self.assertGreaterEqual(len(report["persons"]), 4)

    def test_the_service_notifies_systemd_and_stores_calibrations(self):
        path = self.chroot.root / "run" / "notify"
        systemd = self.enterContext(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
        systemd.bind(str(path))
        os.chmod(path, 0o777)
        systemd.settimeout(60)
        (port,) = free_ports(1)
        state = self.place / "state"
        command = self.chroot.service(
            state,
            NOTIFY_SOCKET="/run/notify",
            WATCHDOG_USEC="1000000",
            LOOKDOWN__SERVER__LISTEN=f"127.0.0.1:{port}",
            LOOKDOWN__SHUTDOWN__GRACE_MILLIS="0",
        )
        with running("deb", command, port, "/readyz", {}) as server:
            self.assertIn("READY=1", said(systemd, until="READY=1"))
            self.assertIn("WATCHDOG=1", said(systemd, until="WATCHDOG=1"))
            report = json.loads(server.post("/detect?profile=fast", (SAMPLES / "office.jpg").read_bytes()))
            self.assertGreater(len(report["persons"]), 3)
            calibration = (SAMPLES / "calibrations" / "office.json").read_bytes()
            url = f"http://{server.address}/calibrations/office"
            headers = {"Content-Type": "application/json"}
            with urllib.request.urlopen(urllib.request.Request(url, calibration, headers, method="PUT"), timeout=10):
                pass
            self.assertEqual([file.name for file in (state / "calibrations").glob("*.json")], ["office.json"])
            server.process.terminate()
            self.assertIn("STOPPING=1", said(systemd, until="STOPPING=1"))
            self.assertEqual(server.process.wait(30), 0)

    def test_removal_keeps_settings_and_state_and_purge_deletes_them(self):
        chroot = Chroot.create(self.place / "removed")
        before = chroot.files()
        chroot.install(self.package)
        settings = chroot.root / SETTINGS
        settings.write_text(settings.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
        # systemd creates the state of a dynamic user like this.
        state = "var/lib/private/lookdown"
        (chroot.root / state / "calibrations").mkdir(parents=True)
        (chroot.root / "var/lib/lookdown").symlink_to("private/lookdown")
        chroot.run("dpkg", "--remove", "lookdown")
        for path, stays in ((UNIT, False), ("usr/lib/lookdown", False), (SETTINGS, True), (state, True)):
            self.assertEqual(chroot.has(path), stays, path)
        chroot.run("dpkg", "--purge", "lookdown")
        after = chroot.files()
        changed = {path for path in before.keys() | after.keys() if before.get(path, path) != after.get(path, path)}
        self.assertEqual(changed, {"var/lib/private"})


def said(systemd: socket.socket, until: str) -> list[str]:
    """The messages to systemd up to this one."""
    messages = []
    while until not in messages:
        messages += systemd.recv(1000).decode().splitlines()
    return messages


def run(command: list[str | Path]) -> str:
    """Returns the output of a command that must succeed."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    if done.returncode != 0:
        raise AssertionError(f"{command}:\n{done.stdout}{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    unittest.main()
