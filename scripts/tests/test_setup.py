"""The set-up as a whole: refusals, and a complete repository, which needs no client."""

import contextlib
import io
import unittest
from pathlib import Path
from unittest import mock

import setup
from assets import main
from assets.console import SetupError
from assets.pins import Archive, Derived, Pins, Runtime
from assets.steps import install_derived, install_model, install_runtime

from .support import InEmptyRepository, archive_of, member, model_of, sha256

LIBRARY = member("lib.so", b"library", to="runtime/libonnxruntime.so")
LICENCE = member("LICENSE", b"licence", to="models/net/LICENSE-weights")
WEIGHTS = member("weights", b"weights")


class OldPython(unittest.TestCase):
    def test_old_python_is_refused_with_version_and_remedy(self):
        self.assertIsNone(setup.refusal_of((3, 11, 0)))
        self.assertIn("3.11 or newer and this is Python 3.9", setup.refusal_of((3, 9, 2)))
        self.assertIn("make setup PYTHON=", setup.refusal_of((2, 7, 18)))

    def test_the_entry_is_readable_to_old_interpreters(self):
        source = Path(setup.__file__).read_text(encoding="utf-8")
        for too_new in ('f"', "->", ":="):
            self.assertNotIn(too_new, source)


class SecondRun(InEmptyRepository):
    def test_nothing_is_fetched_when_everything_is_in_place(self):
        for file, content in ((LIBRARY.to, b"library"), (LICENCE.to, b"licence"), ("models/net/model.onnx", b"onnx")):
            self.write(file, content)
        runtime = Runtime(Archive("r", "1", "r.whl", 1, "0" * 64), (LIBRARY,), "any", "3.11")
        model = model_of(Archive("m", "1", "m.tgz", 1, "0" * 64), (LICENCE, WEIGHTS), b"onnx")
        with mock.patch("subprocess.Popen", side_effect=AssertionError("a program was started")):
            install_runtime(self.places, runtime)
            install_model(self.places, model, Pins({}, (model,), (), (), (), (), ()))
        self.assertIn("ONNX Runtime 1 is in place", self.printed.getvalue())
        self.assertIn("net is in place", self.printed.getvalue())


class Installing(InEmptyRepository):
    def test_caution_is_printed_before_the_download(self):
        model = model_of(archive_of(b""), (WEIGHTS,), b"onnx", caution="its license is not stated")
        self.enterContext(mock.patch("assets.steps.fetch_package", side_effect=SetupError("No network.")))
        with self.assertRaisesRegex(SetupError, "No network"):
            install_model(self.places, model, Pins({}, (model,), (), (), (), (), ()))
        self.assertIn("note on net: its license is not stated", self.printed.getvalue())

    def test_an_int8_form_brings_the_model_it_is_made_from(self):
        model = model_of(archive_of(b""), (WEIGHTS,), b"onnx")
        form = Derived("net_int8", model, "convert.quantise", "activation_ranges.json", sha256(b"int8"), default=False)
        self.enterContext(mock.patch("assets.steps.PrivatePython"))
        install = self.enterContext(mock.patch("assets.steps.install_model"))

        def quantise(_step, command, **_how):
            module, source, result, ranges = command[2:]
            self.assertEqual(module, "convert.quantise")
            self.assertEqual(Path(source), self.places.root / "models/net/model.onnx")
            self.assertEqual(Path(ranges), self.places.root / "models/net_int8/activation_ranges.json")
            Path(result).write_bytes(b"int8")

        self.enterContext(mock.patch("assets.steps.run", side_effect=quantise))
        self.write("models/net_int8/activation_ranges.json", b"{}")
        pins = Pins({}, (model,), (form,), (), (), (), ())
        install_derived(self.places, form, pins)
        install.assert_called_once_with(self.places, model, pins)
        self.assertEqual((self.places.root / "models/net_int8/model.onnx").read_bytes(), b"int8")


class Stopping(InEmptyRepository):
    def stopped_by(self, cause: BaseException) -> tuple[int, str]:
        errors = io.StringIO()
        with mock.patch.object(main, "_set_up", side_effect=cause), contextlib.redirect_stderr(errors):
            return main.main([]), errors.getvalue()

    def test_what_the_user_can_put_right_is_said_without_a_traceback(self):
        self.assertEqual(self.stopped_by(SetupError("Install this.")), (1, "\nThe set-up stopped. Install this.\n"))

    def test_a_full_disk_and_a_foreign_folder_are_explained(self):
        for number, part in ((28, "no space left for /x"), (13, "/x cannot be written by this user")):
            status, text = self.stopped_by(OSError(number, "", "/x"))
            self.assertEqual(status, 1)
            self.assertIn(part, text)

    def test_an_interruption_says_that_nothing_is_lost(self):
        status, text = self.stopped_by(KeyboardInterrupt())
        self.assertEqual(status, 130)
        self.assertIn("What was finished is kept", text)

    def test_an_unknown_step_is_refused_with_the_known_ones(self):
        errors = io.StringIO()
        with contextlib.redirect_stderr(errors):
            self.assertEqual(main.main(["everything"]), 2)
        self.assertIn("toolchain, runtime, model, models", errors.getvalue())
        self.assertIn("ssdlite_mobilenet_v2", errors.getvalue())


class Choosing(unittest.TestCase):
    def chosen(self, *arguments: str) -> list[str]:
        archive = Archive("m", "1", "m.tgz", 1, "0" * 64)
        models = tuple(model_of(archive, (), b"", name=name, default=name == "a") for name in ("a", "b", "c"))
        return [model.name for model in main.chosen_models(models, list(arguments))]

    def test_without_a_name_the_default_models_are_chosen(self):
        self.assertEqual(self.chosen("toolchain", "runtime", "model"), ["a"])

    def test_named_models_are_chosen_instead_of_the_default_ones(self):
        self.assertEqual(self.chosen("model", "c", "b"), ["b", "c"])

    def test_every_model_can_be_asked_for(self):
        self.assertEqual(self.chosen("models"), ["a", "b", "c"])

    def test_other_steps_choose_no_model(self):
        self.assertEqual(self.chosen("runtime"), [])
