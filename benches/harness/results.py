"""RESULTS.md: what was measured last, part by part."""

import json
from types import ModuleType

from .effort import Effort
from .machine import made
from .places import RAW, RESULTS

INTRODUCTION = """# Results

Written by `make bench` (a few minutes, to see that everything works) or `make bench-full` (two hours, for figures
to rely on); how they measure is in [README.md](README.md). Ratios come from windows that alternate in one run;
absolute figures hold for the machine they were measured on.
"""


def measure(part: ModuleType, effort: Effort) -> None:
    """Measures a part and keeps what it found."""
    about = made() | {"effort": effort.name}
    raw = {"made": about, "figures": part.measure(effort)}
    RAW.mkdir(parents=True, exist_ok=True)
    _file(part).write_text(json.dumps(raw, indent=1), encoding="utf-8")


def write(parts: dict[str, ModuleType]) -> None:
    """Tells all parts that were ever measured, in this order."""
    sections = [INTRODUCTION]
    for title, part in parts.items():
        if _file(part).is_file():
            raw = json.loads(_file(part).read_text(encoding="utf-8"))
            figures = raw["figures"]
            sections += [f"## {title}", _told_of(raw["made"]), part.tell(figures), part.draw(figures)]
    RESULTS.write_text("\n\n".join(section.strip() for section in sections if section) + "\n", encoding="utf-8")


def _file(part: ModuleType):
    return RAW / f"{part.__name__.rpartition('.')[2]}.json"


def _told_of(about: dict) -> str:
    return (
        f"*{about['date']}, commit {about['commit']}, {about['effort']} run; {about['cpu']}, {about['cores']} cores, "
        f"{about['memory_gib']:.0f} GiB, {about['system']}; ONNX Runtime {about['onnx_runtime']}, {about['rust']}; "
        f"load of the machine before: {about['load_before']:.1f}*"
    )
