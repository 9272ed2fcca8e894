"""What the set-up downloads: ONNX Runtime once by its sum, and environments with the packages of a requirements file."""

import hashlib
import io
import zipfile
from unittest import mock

from assets import environments, runtime
from assets.console import SetupError, environment
from assets.environments import install
from assets.runtime import Runtime, install_runtime

from .support import InEmptyFolder

FILE = "onnxruntime-1.0-cp311-cp311-manylinux_2_28_x86_64.whl"


def sha256(content: bytes) -> str:
    """The sum of some bytes."""
    return hashlib.sha256(content).hexdigest()


def wheel() -> bytes:
    """A wheel with a library and its licenses."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as opened:
        for name in ("LICENSE", "ThirdPartyNotices.txt", "capi/libonnxruntime.so.1.0"):
            opened.writestr(f"onnxruntime/{name}", name)
    return buffer.getvalue()


WHEEL = wheel()
PINNED = Runtime("1.0", FILE, len(WHEEL), sha256(WHEEL), sha256(b"capi/libonnxruntime.so.1.0"))


class Installing(InEmptyFolder):
    def install(self, fetched: bytes | None):
        """Installs with a pip that writes these bytes, or fails; returns the commands."""
        commands = []

        def run(command, folder, failure):
            commands.append([str(word) for word in command])
            if fetched is None:
                raise SetupError(failure)
            (folder / FILE).write_bytes(fetched)

        with mock.patch.object(runtime, "run", run):
            install_runtime(PINNED, self.folder / "runtime", self.folder / "downloads")
        return commands

    def test_one_wheel_is_downloaded_without_dependencies(self):
        (command,) = self.install(WHEEL)
        self.assertIn("download", command)
        self.assertIn("--no-deps", command)
        self.assertEqual(command[-1], "onnxruntime==1.0")
        self.assertIn("--platform=manylinux_2_28_x86_64", command)
        names = {file.name for file in (self.folder / "runtime").iterdir()}
        self.assertEqual(names, {"libonnxruntime.so", "LICENSE", "ThirdPartyNotices.txt"})

    def test_a_second_run_needs_no_network(self):
        self.install(WHEEL)
        self.assertEqual(self.install(None), [])

    def test_a_wheel_put_in_place_by_hand_is_used(self):
        self.write(f"downloads/{FILE}", WHEEL)
        self.assertEqual(self.install(None), [])

    def test_without_a_network_file_sum_and_place_are_named(self):
        with self.assertRaises(SetupError) as refused:
            self.install(None)
        sentence = str(refused.exception)
        self.assertIn(f"put {FILE} (sha256 {PINNED.sha256}) into {self.folder / 'downloads'}", sentence)

    def test_another_file_is_refused_and_removed(self):
        with self.assertRaisesRegex(SetupError, "not the pinned file"):
            self.install(b"another")
        self.assertEqual(list((self.folder / "downloads").iterdir()), [])

    def test_without_pip_the_remedy_is_named(self):
        self.enterContext(mock.patch.object(runtime.importlib.util, "find_spec", return_value=None))
        self.enterContext(mock.patch.object(runtime.Path, "glob", return_value=iter(())))
        with self.assertRaisesRegex(SetupError, "apt-get install python3-venv"):
            runtime.pip()


class Environments(InEmptyFolder):
    def setUp(self):
        super().setUp()
        self.commands = []

        def run(command, folder, _failure):
            self.commands.append([str(word) for word in command])
            (self.folder / "venv").mkdir(exist_ok=True)

        self.enterContext(mock.patch.object(environments, "run", run))

    def install(self, requirements: bytes):
        file = self.write("needs/checkers.txt", requirements)
        install(self.folder, "checkers", file, self.folder / "venv")

    def test_packages_are_installed_once_by_their_sums(self):
        for _ in range(2):
            self.install(b"a==1 --hash=sha256:00\n")
        self.assertEqual([command[2] for command in self.commands], ["venv", "pip"])
        self.assertIn("--require-hashes", self.commands[1])

    def test_changed_requirements_are_installed_again(self):
        self.install(b"a==1\n")
        self.install(b"a==2\n")
        self.assertEqual([command[2] for command in self.commands], ["venv", "pip", "pip"])

    def test_an_environment_that_was_not_finished_is_made_anew(self):
        half = self.write("venv/half", b"")
        self.install(b"a==1\n")
        self.assertFalse(half.exists())

    def test_without_venv_the_remedy_is_named(self):
        self.enterContext(mock.patch.object(environments.importlib.util, "find_spec", return_value=None))
        with self.assertRaisesRegex(SetupError, "apt-get install python3-venv"):
            self.install(b"a==1\n")


class Environment(InEmptyFolder):
    def test_only_registry_settings_of_the_user_reach_pip(self):
        kept = {"PIP_INDEX_URL": "index", "PIP_CERT": "cert"}
        dropped = {"PIP_TARGET": "t", "PYTHONPATH": "p", "VIRTUAL_ENV": "v"}
        self.enterContext(mock.patch.dict("os.environ", kept | dropped))
        self.assertEqual(kept, {name: environment().get(name) for name in kept})
        self.assertEqual(set(), dropped.keys() & environment().keys())
