"""The private Python environment: creation, settings of pip, missing pip."""

import sys
from unittest import mock

from assets import private_python
from assets.console import SetupError
from assets.pins import Requirement
from assets.private_python import PrivatePython, pip_environment, requirements_text

from .support import InEmptyRepository


class Making(InEmptyRepository):
    def with_modules(self, *names: str) -> list[list[str]]:
        """Pretends that this Python has only these modules and records the commands instead of running them."""
        commands = []

        def run(step, command, **_):
            commands.append(command)
            (self.places.python / "bin").mkdir(parents=True, exist_ok=True)
            (self.places.python / "bin" / "python").touch()

        self.enterContext(mock.patch.object(private_python, "has_module", lambda name: name in names))
        self.enterContext(mock.patch.object(private_python, "run", run))
        return commands

    def test_it_is_made_once(self):
        commands = self.with_modules("venv", "ensurepip")
        python = PrivatePython(self.places, "model")
        self.assertEqual(python.pip("list"), [str(python.python), "-m", "pip", "list"])
        python.pip("list")
        self.assertEqual(commands, [[sys.executable, "-m", "venv", str(self.places.python)]])

    def test_one_that_was_not_finished_is_made_anew(self):
        commands = self.with_modules("venv", "ensurepip")
        half = self.write(".setup/venv/lib/half", b"")
        PrivatePython(self.places, "model").pip("list")
        self.assertEqual(len(commands), 1)
        self.assertFalse(half.exists())

    def test_without_ensurepip_the_pip_of_the_system_works_on_it(self):
        commands = self.with_modules("venv", "pip")
        python = PrivatePython(self.places, "model")
        self.assertEqual(python.pip("list"), [sys.executable, "-m", "pip", "--python", str(python.python), "list"])
        self.assertIn("--without-pip", commands[0])

    def test_it_is_made_anew_once_the_system_can_give_it_a_pip(self):
        self.with_modules("venv", "pip")
        PrivatePython(self.places, "model").pip("list")
        commands = self.with_modules("venv", "pip", "ensurepip")
        PrivatePython(self.places, "model").pip("list")
        self.assertEqual(commands, [[sys.executable, "-m", "venv", str(self.places.python)]])

    def test_without_any_pip_or_without_venv_the_remedy_is_named(self):
        for modules in (("venv",), ("pip", "ensurepip"), ()):
            self.with_modules(*modules)
            with self.assertRaisesRegex(SetupError, "apt-get install python3-venv"):
                PrivatePython(self.places, "model").pip("list")

    def test_requirements_file_is_installed_once_in_its_folder(self):
        commands = self.with_modules("venv", "ensurepip")
        file = self.write("lab/benches/peers/other/requirements.txt", b"a==1\n")
        python = PrivatePython(self.places, "benches", self.places.python)
        python.install_file(file)
        python.install_file(file)
        self.assertEqual(["venv", "pip"], [command[2] for command in commands])
        self.assertNotIn("--require-hashes", commands[1])


class Environment(InEmptyRepository):
    def test_only_registry_settings_of_the_user_reach_pip(self):
        kept = {"PIP_INDEX_URL": "index", "PIP_FIND_LINKS": "links", "PIP_CERT": "cert", "PIP_CONFIG_FILE": "file"}
        dropped = {"PIP_TARGET": "t", "PIP_NO_BINARY": "onnx", "PYTHONPATH": "p", "PYTHONHOME": "h", "VIRTUAL_ENV": "v"}
        self.enterContext(mock.patch.dict("os.environ", kept | dropped | {"PIP_REQUIRE_VIRTUALENV": "1"}))
        environment = pip_environment()
        self.assertEqual(kept, {name: environment.get(name) for name in kept})
        self.assertEqual(set(), dropped.keys() & environment.keys())
        self.assertEqual(environment["PIP_REQUIRE_VIRTUALENV"], "0")

    def test_requirements_carry_versions_markers_and_every_sum(self):
        pins = (Requirement("a", "1", "python_version < '3.15'", ("0" * 64, "1" * 64)), Requirement("b", "2", None, ()))
        hashes = f"--hash=sha256:{'0' * 64} --hash=sha256:{'1' * 64}"
        self.assertEqual(requirements_text(pins), f"a==1 ; python_version < '3.15' {hashes}\nb==2\n")
