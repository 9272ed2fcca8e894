"""Python source packages: pip gets the sum and a pinned build backend before it runs their code."""

from pathlib import Path
from unittest import mock

from assets import downloads
from assets.downloads import fetch_package
from assets.pins import Pins, Requirement
from assets.private_python import PrivatePython

from .support import InEmptyRepository, archive_of, model_of

CONTENT = b"sources" * 1000
ARCHIVE = archive_of(CONTENT, "thing-1.0.tar.gz")
BUILDER = (Requirement("setuptools", "80.0.0", None, ("0" * 64,)),)


class SourcePackages(InEmptyRepository):
    def test_pip_is_told_the_sum_and_works_with_the_pinned_builder(self):
        commands, installed = [], []
        requirements = []

        def run(step, command, *, folder: Path, **_):
            commands.append(command)
            listed = next(part for part in command if part.startswith("--requirement="))
            requirements.append(Path(listed.partition("=")[2]).read_text(encoding="utf-8"))
            (folder / ARCHIVE.file).write_bytes(CONTENT)

        def install(python, label, pins):
            installed.append((label, pins))

        self.enterContext(mock.patch.object(PrivatePython, "install", install))
        self.enterContext(mock.patch.object(PrivatePython, "pip", lambda python, *arguments: list(arguments)))
        self.enterContext(mock.patch.object(downloads, "run", run))
        model = model_of(ARCHIVE, (), b"onnx", registry="pypi")
        kept = fetch_package(self.places, model, Pins({}, (model,), (), (), (), BUILDER, ()), "model")
        self.assertEqual(kept.read_bytes(), CONTENT)
        self.assertEqual(installed, [("builder", BUILDER)])
        self.assertEqual(requirements, [f"thing==1.0 --hash=sha256:{ARCHIVE.sha256}\n"])
        for switch in ("--require-hashes", "--no-build-isolation", "--no-deps"):
            self.assertIn(switch, commands[0])
