"""The stored rows as Markdown for docs/lab/reliability.md."""

import json
from collections.abc import Iterable
from pathlib import Path

HEAD = "| proof | what was done | what was seen | wrong |\n|---|---|---|---:|"


def markdown(folder: Path, parts: Iterable[str]) -> str:
    """The table of each part's long form, or else its short form, with the machine it ran on."""
    kept = [read for part in parts if (read := _kept(folder, part))]
    lines = [HEAD]
    for part in kept:
        for row in part["rows"]:
            cells = (row["name"], row["done"], row["skipped"] or row["seen"], str(len(row["faults"])))
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    runs: dict[str, list[str]] = {}
    for part in kept:
        runs.setdefault(_ran_on(part["made"]), []).append(f"{part['name']} ({part['seconds']:.0f} s)")
    return "\n".join([*lines, "", *(f"* {', '.join(names)}: {run}" for run, names in runs.items())])


def _kept(folder: Path, part: str) -> dict | None:
    for effort in ("long", "short"):
        file = folder / f"{effort}-{part}.json"
        if file.is_file():
            return json.loads(file.read_text(encoding="utf-8")) | {"name": part}
    return None


def _ran_on(made: dict) -> str:
    return (
        f"{made['effort']} form, {made['date'][:10]}, commit {made['commit']}. {made['cpu']}, {made['cores']} cores, "
        f"{made['memory_gib']:.0f} GiB, {made['system']}; ONNX Runtime {made['onnx_runtime']}, {made['rust']}"
    )
