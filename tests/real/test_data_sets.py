"""Data sets: supervision, pycocotools and datumaro read our files, and `lookdown eval` reads theirs."""

import json
import shutil
import tempfile
import unittest
from pathlib import Path

from commands import run
from harness.places import LOOKDOWN, ROOT, SAMPLES

TOOLS = Path(__file__).resolve().parent / "data_sets" / "tools.py"
PYTHON = ROOT / ".setup" / "real" / "data_sets" / "bin" / "python"
FAST = ("--profile", "fast", "--score-threshold", "0.3")


class DataSets(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        (cls.folder / "images").mkdir()
        for name in ("office.jpg", "canteen.jpg"):
            shutil.copy(SAMPLES / name, cls.folder / "images")
        for name in ("coco", "cvat", "yolo", "voc"):
            out = ["--format", name, "--out", cls.folder / name]
            run(LOOKDOWN, "detect", cls.folder / "images", *FAST, *out)
        cls.persons = json.loads((cls.folder / "coco/annotations.json").read_text(encoding="utf-8"))["annotations"]
        cls.read = json.loads(run(PYTHON, TOOLS, cls.folder).splitlines()[-1])

    def test_each_tool_reads_every_person(self) -> None:
        self.assertEqual(len(self.read), 8)
        self.assertGreater(len(self.persons), 5)
        self.assertEqual(set(self.read.values()), {len(self.persons)}, self.read)

    def test_eval_reads_the_data_sets_of_the_tools(self) -> None:
        for data_set in sorted((self.folder / "written").iterdir()):
            with self.subTest(data_set.name):
                saved = self.folder / f"{data_set.name}.saved"
                run(LOOKDOWN, "eval", data_set, *FAST, "--refine", "fusion", "--save-detections", saved)
                (results,) = saved.glob("*.json")
                row = json.loads(run(LOOKDOWN, "eval", data_set, "--from-detections", results, "--json"))
                self.assertEqual((row["ap50"], row["persons"]), (1.0, len(self.persons)), row)


if __name__ == "__main__":
    unittest.main()
