"""Environments of checkers and tests: made once, with the packages of a requirements file."""

from unittest import mock

from assets import environments
from assets.console import SetupError, environment
from assets.environments import install

from .support import InEmptyFolder


class Installing(InEmptyFolder):
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
