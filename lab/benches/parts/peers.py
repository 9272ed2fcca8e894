"""Other servers in the same run, alternating with Lookdown.

(a) plain Python as one writes it, with the paper's plan and with ours; (b) sliced inference over the frame itself with
`supervision`.
"""

import json
import time
from contextlib import ExitStack
from pathlib import Path

from harness import peers
from harness.boxes import boxes, matched
from harness.effort import Effort
from harness.figures import ratios, spread, spread_cell, table
from harness.frames import frame
from harness.load import load, steady
from harness.lookdown import ROOMY, detect, lookdown, report, runs_of, view_plan
from harness.places import WORK
from harness.processes import Server

OURS, THEIRS = ("Lookdown, `balanced`", "Lookdown, `fast`"), "plain Python, "
SLICE = 640
"""Side of a slice in pixels, the default of `supervision`. No other side finds many more people (NOTES.md)."""
NAMES = {
    "plain": f"{THEIRS}our `balanced` plan with crops",
    "paper": f"{THEIRS}the paper's plan",
    "slicer": f"supervision's InferenceSlicer, {SLICE} px",
}
TUNED = ("plain", "slicer")
"""The peers whose settings are searched; the paper's plan takes those of ours."""
SLOW_CLIENTS = 4
"""Clients of the paper's plan in plain Python, enough to keep all cores busy at many seconds per frame."""
PUBLISHED = (
    "RAPiD takes 1.8 s an image on an Intel i7-8559U (four cores), by its authors (arXiv 2312.06544). Not run here: its "
    "license forbids commercial use."
)
# The comparisons.
PAIRS = (
    (OURS[0], NAMES["plain"]),
    (OURS[1], NAMES["paper"]),
    (OURS[1], NAMES["slicer"]),
)


def measure(effort: Effort) -> dict:
    """Tunes each peer, then measures all of them alternately."""
    with ExitStack() as stack:
        ours = stack.enter_context(lookdown(ROOMY))
        plan, paper_plan = view_plan(ours, "balanced"), view_plan(ours, "paper")
        _, crops = runs_of(ours, "balanced")
        starts = {
            "plain": lambda setting: peers.plain_python(setting, plan_file(plan), "nms", crops),
            "paper": lambda setting: peers.plain_python(setting, plan_file(paper_plan), "soft_nms"),
            "slicer": lambda setting: peers.slicer(setting, SLICE),
        }
        asked = plain_body()
        tuned = {name: tune(effort, starts[name], asked) for name in TUNED}
        tuned["paper"] = tuned["plain"]
        setting = {name: peers.Setting(**best(rows)["setting"]) for name, rows in tuned.items()}
        servers = {name: stack.enter_context(start(setting[name])) for name, start in starts.items()}
        turns = {
            OURS[0]: (ours, plain_body() | {"paths": [detect("balanced")]}),
            OURS[1]: (ours, plain_body() | {"paths": [detect("fast")]}),
        } | {NAMES[name]: (server, asked) for name, server in servers.items()}
        clients = dict.fromkeys(turns, effort.peer_clients) | {NAMES["paper"]: SLOW_CLIENTS}
        rounds = {name: [] for name in turns}
        for _ in range(effort.rounds):
            for name, (server, what) in turns.items():
                rounds[name].append(window(server, what, clients[name], effort.seconds))
        return {
            "settings": {NAMES[name]: chosen.text() for name, chosen in setting.items()},
            "tuning": {NAMES[name]: tuned[name] for name in TUNED},
            "clients": clients,
            "rounds": rounds,
            "agreement": agreement(ours, servers["plain"]),
        }


def plan_file(plan: dict) -> Path:
    """A view plan as a file."""
    file = WORK / f"plan-{plan['profile']}.json"
    file.write_text(json.dumps(plan), encoding="utf-8")
    return file


def plain_body() -> dict:
    """The request to a plain Python server."""
    return {"paths": ["/detect"], "body": frame(), "content_type": "image/jpeg"}


def window(server: Server, what: dict, clients: int, seconds: float) -> dict:
    """A closed loop with at least two responses per client."""
    began = time.monotonic()
    server.post(what["paths"][0], what["body"].read_bytes(), what["content_type"])
    alone = time.monotonic() - began
    return steady(server, clients=clients, seconds=seconds, frame_seconds=alone, **what)


def tune(effort: Effort, start, what: dict) -> list[dict]:
    """Frames per second under each setting."""
    rows = []
    for setting in peers.settings()[:: 1 if effort.name == "full" else 3]:
        with start(setting) as server:
            result = load(server, clients=4, warm_up=2.0, seconds=2.0 * effort.tune_seconds, **what)
        rows.append({"setting": vars(setting), "frames_per_second": result["succeeded_per_second"]})
    return rows


def best(rows: list[dict]) -> dict:
    """The row with the most frames per second."""
    return max(rows, key=lambda row: row["frames_per_second"])


def tell(raw: dict) -> str:
    """The comparison as Markdown."""
    rows = []
    for name, rounds in raw["rounds"].items():
        p99 = spread([result["succeeded"].get("p99_ms", float("nan")) for result in rounds])
        per_second = spread([result["succeeded_per_second"] for result in rounds])
        cpu = spread([result["cpu_seconds_per_frame"] for result in rounds])
        clients = raw["clients"][name]
        rows.append((name, clients, per_second.median, p99.median, cpu.median, rounds[-1]["resident_mib"]))
    compared = []
    for ours, theirs in PAIRS:
        mine, other = raw["rounds"][ours], raw["rounds"][theirs]
        faster = ratios(*[[result["succeeded_per_second"] for result in rounds] for rounds in (mine, other)])
        later = ratios(*[[result["succeeded"]["p99_ms"] for result in rounds] for rounds in (mine, other)])
        # Queueing times are comparable only for queues of the same length.
        same_queue = raw["clients"][ours] == raw["clients"][theirs]
        late = spread_cell(later) if same_queue else "–"
        compared.append((f"{ours} ÷ {theirs}", spread_cell(faster), late))
    settings = "\n".join(f"* {name}: {setting}" for name, setting in raw["settings"].items())
    head = ("server", "clients", "frames/s", "p99, ms", "CPU s per frame", "memory, MiB")
    return (
        f"{table(head, rows)}\n{table(('ratio, median (range)', 'frames/s', 'p99'), compared)}\n"
        f"{PUBLISHED}\n\nThe best of the tested settings:\n\n{settings}\n\n{told_agreement(raw['agreement'])}"
    )


def agreement(ours: Server, theirs: Server) -> list[dict]:
    """Compares the boxes of both servers with one plan and the same models, for two refinements of Lookdown."""
    other = boxes(json.loads(theirs.post("/detect", frame().read_bytes())))
    rows = []
    for refine in ("fusion", "nms"):
        mine = boxes(report(ours, f"{detect('balanced')}&refine={refine}", frame()))
        overlaps = matched(mine, other)
        mean = sum(overlaps) / max(len(overlaps), 1)
        rows.append(
            {"refine": refine, "ours": len(mine), "theirs": len(other), "same": len(overlaps), "mean_iou": mean}
        )
    return rows


def told_agreement(rows: list[dict]) -> str:
    """The agreement of the plain server's persons with Lookdown's."""
    head = ("our refinement", "boxes we find", "boxes it finds with NMS", "the same ones", "mean IoU of those")
    found = [(row["refine"], row["ours"], row["theirs"], row["same"], row["mean_iou"]) for row in rows]
    return f"Agreement of the results, with the same plan and models:\n\n{table(head, found)}"
