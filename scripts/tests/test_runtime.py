"""ONNX Runtime: fetched once by its sum, with pip or by hand."""

import hashlib
import io
import zipfile
from unittest import mock

from assets import runtime
from assets.console import SetupError
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
