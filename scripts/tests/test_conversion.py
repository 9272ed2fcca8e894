"""Converters on the command line: their Python environment and their errors."""

import contextlib
import io
import subprocess
import sys
from unittest import mock

from assets import conversion
from assets.places import Places
from assets.private_python import PrivatePython
from convert.errors import ConversionError

from .support import InEmptyRepository


class Conversion(InEmptyRepository):
    def setUp(self):
        super().setUp()
        self.enterContext(mock.patch.object(conversion, "ROOT", self.places.root))
        self.errors = self.enterContext(contextlib.redirect_stderr(io.StringIO()))

    def in_private_python(self, convert) -> int:
        with mock.patch.object(sys, "prefix", str(self.places.python)):
            return conversion.main("convert_net.py", convert)

    def test_private_python_converts_and_prints_the_result(self):
        self.assertEqual(self.in_private_python(lambda: "model.onnx: 3 weights"), 0)
        self.assertEqual(self.printed.getvalue(), "model.onnx: 3 weights\n")

    def test_other_python_runs_the_private_one_with_same_arguments(self):
        installed = []
        self.enterContext(mock.patch.object(conversion, "read_pins", mock.Mock()))
        self.enterContext(mock.patch.object(PrivatePython, "install", lambda *arguments: installed.append(arguments)))
        self.enterContext(mock.patch.object(sys, "argv", ["convert_net.py", "net.cfg", "out folder"]))
        run = self.enterContext(mock.patch.object(subprocess, "run"))
        run.return_value.returncode = 3
        self.assertEqual(conversion.main("/scripts/convert_net.py", self.fail), 3)
        python = str(Places(self.places.root).python / "bin" / "python")
        self.assertEqual(run.call_args.args[0], [python, "/scripts/convert_net.py", "net.cfg", "out folder"])
        self.assertEqual(len(installed), 1)

    def test_conversion_error_is_printed_without_traceback(self):
        causes = (
            (ConversionError("The file is short."), "The conversion stopped. The file is short.\n"),
            (FileNotFoundError(2, "No such file", "a.cfg"), "The conversion stopped. No such file: a.cfg\n"),
        )
        for cause, text in causes:
            self.errors.seek(0)
            self.errors.truncate()
            self.assertEqual(self.in_private_python(mock.Mock(side_effect=cause)), 1)
            self.assertEqual(self.errors.getvalue(), text)
