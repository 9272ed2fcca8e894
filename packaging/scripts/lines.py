"""Counts production Rust by crate, and fails where a crate is beyond its budget: `lines.py [--check]`.

Counted are `src` and `crates` without tests. A budget limits code and lone brackets; comments and blank lines are
free. `budget.txt` beside this file has a line for each crate: its name, its budget, and the reason of the last change.
"""

import re
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUDGETS = Path(__file__).with_name("budget.txt")
KINDS = ("code", "brackets", "comments", "blanks")
# A module of tests: in the rest of its file, or in a file of its own.
TESTS = re.compile(r"^#\[cfg\(test\)\]\n(?:#\[.*\]\n)*(?:pub(?:\(.*\))? )?mod (\w+)( \{|;)", re.MULTILINE)


def kind(line: str) -> str:
    """The kind of a line."""
    if not line:
        return "blanks"
    if line.startswith("//"):
        return "comments"
    return "brackets" if re.fullmatch(r"[][(){}<>|,;?]+", line) else "code"


def production(folder: Path) -> dict[Path, str]:
    """The files below a folder, with their text without tests."""
    texts, tests = {}, set()
    for file in sorted(folder.rglob("*.rs")):
        parts = file.relative_to(folder).parts
        if "tests" in parts or file.name == "tests.rs" or "target" in parts:
            continue
        text = file.read_text(encoding="utf-8")
        for found in TESTS.finditer(text):
            if found[2] == " {":
                text = text[: found.start()]
                break
            parent = file.parent if file.name in ("lib.rs", "main.rs") else file.with_suffix("")
            tests.update((parent / found[1], parent / f"{found[1]}.rs"))
        texts[file] = text
    return {file: text for file, text in texts.items() if not tests.intersection((file, *file.parents))}


def main() -> int:
    folders = {"lookdown": ROOT / "src"} | {crate.name: crate for crate in sorted((ROOT / "crates").iterdir())}
    budgets = {}
    for line in BUDGETS.read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            crate, lines, _reason = line.split(maxsplit=2)
            budgets[crate] = int(lines)
    is_check, total, failed = "--check" in sys.argv, Counter(), budgets.keys() ^ folders.keys()
    for crate in sorted(failed):
        print(f"{BUDGETS.name}: {crate} needs one line with a budget and a reason, and only a crate has one")
    print(f"{'crate':20} {' '.join(f'{name:>9}' for name in KINDS)} {'budget':>9}")
    for crate, folder in folders.items():
        texts = production(folder).values()
        counts = Counter(kind(line.strip()) for text in texts for line in text.splitlines())
        total += counts
        used, budget = counts["code"] + counts["brackets"], budgets.get(crate, 0)
        print(f"{crate:20} {' '.join(f'{counts[name]:9}' for name in KINDS)} {used:9} of {budget}")
        if crate in budgets and used > budget:
            failed = failed | {crate}
            print(f"{crate} is {used - budget} lines beyond its budget: remove code, or raise the budget with a reason")
    print(f"{'all':20} {' '.join(f'{total[name]:9}' for name in KINDS)} {total['code'] + total['brackets']:9}")
    return int(is_check and bool(failed))


if __name__ == "__main__":
    sys.exit(main())
