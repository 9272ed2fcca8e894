"""The set-up as a whole: what stops it."""

import contextlib
import io
import unittest
from pathlib import Path
from unittest import mock

import setup
from assets import main
from assets.console import SetupError


class OldPython(unittest.TestCase):
    def test_old_python_is_refused_with_version_and_remedy(self):
        self.assertIsNone(setup.refusal_of((3, 11, 0)))
        self.assertIn("3.11 or newer and this is Python 3.9", setup.refusal_of((3, 9, 2)))
        self.assertIn("make setup PYTHON=", setup.refusal_of((2, 7, 18)))

    def test_the_entry_is_readable_to_old_interpreters(self):
        source = Path(setup.__file__).read_text(encoding="utf-8")
        for too_new in ('f"', "->", ":="):
            self.assertNotIn(too_new, source)


class Stopping(unittest.TestCase):
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
        self.assertIn("toolchain, runtime, models", errors.getvalue())
