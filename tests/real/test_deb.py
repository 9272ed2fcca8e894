"""The Debian package: its checks, and its life in a minimal Debian from installation to purge."""

import json
import shutil
import sys
import tempfile
import unittest
import urllib.request
from pathlib import Path

from commands import run
from debian import UNIT, Chroot, booted
from harness.places import LOOKDOWN, ROOT, SAMPLES
from harness.processes import free_ports
from state import wait_until

SCRIPTS = ROOT / "packaging" / "scripts"
LARGEST_EXPOSURE = 2.0
SERVICE = "lookdown.service"
STATE = "var/lib/private/lookdown"
"""Where systemd keeps the state of a service with a dynamic user."""
SETTINGS = "etc/lookdown/lookdown.toml"
ENABLED = "etc/systemd/system/multi-user.target.wants/lookdown.service"


class DebianPackage(unittest.TestCase):
    """The package of `make deb`, installed once for all tests but those of its removal."""

    @classmethod
    def setUpClass(cls):
        run(sys.executable, SCRIPTS / "dist.py", LOOKDOWN)
        run(sys.executable, SCRIPTS / "deb.py")
        (cls.package,) = (ROOT / "target" / "deb").glob("*.deb")
        cls.place = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.chroot = Chroot.create(cls.place / "installed")
        cls.chroot.install(cls.package)
        print(f"\n  package {cls.package.stat().st_size / 1e6:.1f} MB", flush=True)

    def test_lintian_finds_nothing(self):
        self.assertEqual(run("lintian", "--allow-root", "--fail-on=error,warning", self.package), "")

    def test_systemd_accepts_the_unit(self):
        chroot = Chroot.create(self.place / "verified")
        chroot.install(self.package)
        for unit in ("lookdown.service", "lookdown-watch.service", "lookdown-count.service"):
            command = ["systemd-analyze", "verify", "--man=no", f"--root={chroot.root}", unit]
            self.assertEqual(run(*command), "")

    def test_the_service_is_confined(self):
        root = f"--root={self.chroot.root}"
        threshold = f"--threshold={LARGEST_EXPOSURE * 10:.0f}"
        command = ["systemd-analyze", "security", "--no-pager", "--offline=true", threshold, root, "lookdown.service"]
        print(f"\n  {run(*command).strip().splitlines()[-1]}", flush=True)

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

    def test_systemd_runs_the_service(self):
        (port,) = free_ports(1)
        chroot = Chroot.create(self.place / "booted")
        chroot.install(self.package)
        environment = f"LOOKDOWN__SERVER__LISTEN=127.0.0.1:{port}\nLOOKDOWN__SHUTDOWN__GRACE_MILLIS=0\n"
        (chroot.root / "etc/default/lookdown").write_text(environment, encoding="utf-8")
        changes = chroot.root / "etc/systemd/system/lookdown.service.d/watchdog.conf"
        changes.parent.mkdir()
        changes.write_text("[Service]\nWatchdogSec=2\n", encoding="utf-8")
        log = ROOT / "target" / "deb" / "console.log"
        with booted(chroot.root, log) as system:
            said = system.run("sh", "-c", f"journalctl --no-pager --unit={SERVICE}; true")
            self.assertEqual(system.show(SERVICE, "ActiveState"), "active", said)
            self.assertNotEqual(system.run("stat", "--format=%U", f"/proc/{system.show(SERVICE, 'MainPID')}"), "root")

            server = f"http://127.0.0.1:{port}"
            report = json.loads(send(f"{server}/detect?profile=fast", SAMPLES / "office.jpg", "image/jpeg", "POST"))
            self.assertGreater(len(report["persons"]), 3)
            calibration = SAMPLES / "calibrations" / "office.json"
            send(f"{server}/calibrations/office", calibration, "application/json", "PUT")
            stored = chroot.root / STATE / "calibrations"
            self.assertEqual([file.name for file in stored.glob("*.json")], ["office.json"])

            system.run("systemctl", "reload", SERVICE)
            self.assertEqual(system.show(SERVICE, "NRestarts"), "0")

            # A stopped process makes no progress: systemd replaces it, and the new one finds what was stored.
            system.run("systemctl", "kill", "--signal=STOP", SERVICE)
            wait_until(lambda: system.show(SERVICE, "NRestarts") == "1", "the watchdog restarts the service", 60)
            wait_until(lambda: system.show(SERVICE, "ActiveState") == "active", "the service runs again", 60)
            with urllib.request.urlopen(f"{server}/calibrations/office", timeout=60) as answer:
                self.assertEqual(answer.status, 200)

            system.run("systemctl", "stop", SERVICE)
            self.assertEqual([system.show(SERVICE, name) for name in ("Result", "ExecMainStatus")], ["success", "0"])

    def test_removal_keeps_settings_and_state_and_purge_deletes_them(self):
        chroot = Chroot.create(self.place / "removed")
        before = chroot.files()
        chroot.install(self.package)
        settings = chroot.root / SETTINGS
        settings.write_text(settings.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
        # systemd creates the state of a dynamic user like this.
        (chroot.root / STATE / "calibrations").mkdir(parents=True)
        (chroot.root / "var/lib/lookdown").symlink_to("private/lookdown")
        chroot.run("dpkg", "--remove", "lookdown")
        for path, stays in ((UNIT, False), ("usr/lib/lookdown", False), (SETTINGS, True), (STATE, True)):
            self.assertEqual(chroot.has(path), stays, path)
        chroot.run("dpkg", "--purge", "lookdown")
        after = chroot.files()
        changed = {path for path in before.keys() | after.keys() if before.get(path, path) != after.get(path, path)}
        self.assertEqual(changed, set())


def send(url: str, file: Path, media_type: str, method: str) -> bytes:
    """Sends a file and returns the body of the response."""
    headers = {"Content-Type": media_type}
    request = urllib.request.Request(url, file.read_bytes(), headers, method=method)
    with urllib.request.urlopen(request, timeout=60) as answer:
        return answer.read()


if __name__ == "__main__":
    unittest.main()
