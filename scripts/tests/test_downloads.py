"""Downloads: only complete archives are kept."""

import os
import sys

from assets.console import SetupError
from assets.downloads import fetch

from .support import InEmptyRepository, archive_of

CONTENT = b"the whole archive" * 1000
PIN = archive_of(CONTENT)


class Downloads(InEmptyRepository):
    def fetch(self, script: str):
        """Fetches with a client that is this Python script, run in the folder where the archive has to appear."""
        return fetch(
            self.places,
            PIN,
            "model",
            client="npm",
            command=lambda folder: [sys.executable, "-c", script],
            environment=dict(os.environ),
        )

    def writing(self, content: bytes) -> str:
        source = self.write("source", content)
        return f"import shutil; shutil.copy({str(source)!r}, {PIN.file!r})"

    def test_a_fetched_archive_is_kept_and_not_fetched_again(self):
        kept = self.fetch(self.writing(CONTENT))
        self.assertEqual(kept.read_bytes(), CONTENT)
        self.assertEqual(self.fetch("raise SystemExit('fetched again')"), kept)
        self.assertIn("was fetched before", self.printed.getvalue())

    def test_half_an_archive_from_a_broken_run_is_replaced(self):
        self.write(f".setup/downloads/{PIN.file}", CONTENT[:100])
        self.assertEqual(self.fetch(self.writing(CONTENT)).read_bytes(), CONTENT)

    def test_an_archive_with_another_sum_is_refused_and_thrown_away(self):
        with self.assertRaisesRegex(SetupError, f"{PIN.file} from npm is not the file .* pinned is {PIN.sha256}"):
            self.fetch(self.writing(CONTENT[:-1] + b"!"))
        self.assertFalse((self.places.downloads / PIN.file).exists())

    def test_killed_client_leaves_no_files(self):
        script = f"import os; open({PIN.file!r}, 'wb').write(b'half'); os.kill(os.getpid(), 9)"
        with self.assertRaisesRegex(SetupError, "npm could not fetch thing 1.0"):
            self.fetch(script)
        self.assertFalse((self.places.downloads / PIN.file).exists())
        self.assertEqual(list((self.places.own / "unfinished").iterdir()), [])
        self.assertEqual(self.fetch(self.writing(CONTENT)).read_bytes(), CONTENT)

    def test_a_failing_client_is_quoted_with_the_remedies(self):
        with self.assertRaises(SetupError) as refusal:
            self.fetch("raise SystemExit('host not found')")
        for part in ("host not found", "Check the network", f"put {PIN.file} into {self.places.downloads} yourself"):
            self.assertIn(part, str(refusal.exception))

    def test_a_client_that_writes_nothing_is_not_taken_for_a_success(self):
        with self.assertRaisesRegex(SetupError, f"wrote no {PIN.file}"):
            self.fetch("pass")


class Leftovers(InEmptyRepository):
    def test_unfinished_work_of_a_killed_run_is_cleared_away(self):
        leftover = self.write(".setup/unfinished/abc/half", b"half")
        with self.places.locked():
            self.assertFalse(leftover.exists())
