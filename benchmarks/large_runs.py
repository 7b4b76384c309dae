"""Costs of runs of up to a million cases: the plan, the table, the journal. With made-up answers.

    python benchmarks/large_runs.py [--most 1000000] [--methods 10] [-o results/large_runs]

For 10^3 ... 10^6 cases (as many pairs as clips) it measures, each in a process of its own with its imports:

    plan     from a request with so many methods to the shards that processes are given
    write    rows of one method with a number for every value that installed metrics declare
    table    the default ``bench table`` of all methods
    journalled  appending a finished case, near the beginning and near the end, and reading all of it again

in seconds of the clock and of the processor and megabytes at the peak, writes them as CSV and a picture,
and prints the table of ``results/measurements.md``.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import Case, CaseInfo, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.evaluation.header_builder import header_of
from retarget_bench.evaluation.plan import EvaluationUnit, Plan, evaluation_units
from retarget_bench.evaluation.shards import cut
from retarget_bench.files import write_csv
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import case_metadata, journal, store
from retarget_bench.results.header import Counts
from retarget_bench.results.rows import Numbers
from retarget_bench.results.store import CaseResult

METHODS = (
    "copy_rotations", "bone_directions", "nearest_pose", "identity", "linear_joints",
    *(f"copy_rotations[root_rule={rule}]" for rule in ("height", "leg_length", "none")),
    "gaussian_filter", "savitzky_golay",
)  # fmt: skip
FIELDS = ("cases", "methods", "what", "wall_s", "processor_s", "peak_mb", "note")
BODIES = 40
JOINTS = (
    "Hips",
    "Spine",
    "Head",
    "LeftUpLeg",
    "LeftLeg",
    "LeftFoot",
    "RightUpLeg",
    "RightLeg",
    "RightFoot",
)


class MadeUp:
    """Cases without motion: as many pairs of forty bodies as clips."""

    card = DatasetCard(
        name="large_runs",
        summary="none",
        version="1",
        licence="CC0",
        obtain="here",
        splits=usual_splits("intra"),
    )
    label = "made up"
    notes = ()

    def __init__(self, cases: int = 1000) -> None:
        self.size = cases
        self.content = f"made-up-{cases}"

    def characters(self) -> dict[str, Character]:
        offsets = np.array(
            [[0, 0.9, 0], [0, 0.3, 0], [0, 0.4, 0], *2 * [[0.1, -0.05, 0], [0, -0.4, 0], [0, -0.4, 0]]]
        )
        offsets[6, 0] = -0.1
        skeleton = Skeleton(JOINTS, np.array([-1, 0, 1, 0, 3, 4, 0, 6, 7]), offsets)
        body = Character.of("body", skeleton, structure="toy")
        return {f"body_{number}": body for number in range(BODIES)}

    def cases(self, task: str, split: str) -> list[CaseInfo]:
        clips = round(self.size**0.5)
        cases = []
        for number in range(self.size):
            pair, clip = divmod(number, clips)
            one, other = f"body_{pair // (BODIES - 1)}", pair % (BODIES - 1)
            other = f"body_{other + (other >= pair // (BODIES - 1))}"
            name = f"clip_{clip:04}"
            cases.append(
                CaseInfo(f"large_runs/{one}>{other}/{name}", task, split, one, other, name, "walk", 300)
            )
        return cases

    def load(self, info: CaseInfo) -> Case:
        raise NotImplementedError


plugin = MadeUp


def units(root: Path, cases: int, methods: int) -> list[EvaluationUnit]:
    registry.add_file(Path(__file__))
    names = tuple(entry.name for entry in registry.names("metrics") if "fid" not in entry.name)
    plan = Plan(
        methods=tuple(map(Spec.parse, METHODS[:methods])),
        datasets=(Spec.parse(f"large_runs[cases={cases}]"),),
        metrics=names,
        out=root,
    )
    return evaluation_units(plan)


# --------------------------------------------------------------------------------------------- measures
def plan(root: Path, cases: int, methods: int) -> str:
    planned = units(root, cases, methods)
    shards = [
        sum(len(lacking) for task in shard for lacking in task.lacking.values())
        for shard in cut(dict.fromkeys(planned, ()))
    ]
    return f"{sum(shards):,} answers in {len(shards):,} shards"


def write(root: Path, cases: int, methods: int) -> str:
    """Rows of all methods; the time is that of all."""
    for number, unit in enumerate(units(root, cases, methods)):
        header = replace(header_of(unit, ()), counts=Counts(asked=cases, ok=cases))
        values = [key for key, value in header.values.items() if not value.index]
        if not number:
            case_metadata.write(unit.paths, unit.data, unit.infos)
        store.write_numbers(unit.paths, header, made_up(cases, values, number), unit.infos)
    size = sum(path.stat().st_size for path in root.rglob("*") if path.is_file())
    return f"{len(values)} values, {size / 1e6:.0f} MB on disk"


def made_up(cases: int, values: Sequence[str], method: int) -> Numbers:
    """Lognormal numbers, of which eight columns recur."""
    pool = np.random.default_rng(method).lognormal(method / 10, size=(8, cases))
    return {(key, ""): pool[number % 8] for number, key in enumerate(values)}


def table(root: Path, cases: int, methods: int) -> str:
    from retarget_bench.cli import main

    with suppress(SystemExit):
        main(["table", "-r", str(root)])
    return ""


def journalled(root: Path, cases: int, methods: int) -> str:
    """Processor time per entry near the beginning and the end, and of opening it again."""
    place = units(root, cases, 1)[0].paths
    values: store.Values = {f"value_{n}": 1 / (n + 3) for n in range(10)}
    journal.open_journal(place, {})
    tenth = max(1, min(cases, 10_000) // 10)
    times = []
    start = time.process_time()
    for number in range(cases):
        if number in (tenth, cases - tenth, cases - 1):
            times.append(time.process_time() - start)
        journal.append_journal(place, CaseResult(f"large_runs/a>b/clip_{number}", "ok", values=values))
    first, last = times[0] / tenth, (times[2] - times[1]) / tenth
    start = time.process_time()
    assert len(journal.open_journal(place, {})) == cases
    again = time.process_time() - start
    place.journal.unlink()
    return f"{1e6 * first:.0f} then {1e6 * last:.0f} us per entry; opened again in {again:.2f} s"


MEASURES = {each.__name__: each for each in (plan, write, table, journalled)}


def measured(what: str, root: Path, cases: int, methods: int) -> dict[str, Any]:
    command = [sys.executable, __file__, "--measure", what, "--root", str(root)]
    command += ["--most", str(cases), "--methods", str(methods)]
    start = time.perf_counter()
    completed = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    seconds = time.perf_counter() - start
    facts = json.loads(completed.stdout.splitlines()[-1])
    row = {"cases": cases, "methods": methods, "what": what, "wall_s": f"{seconds:.2f}"} | facts
    print(*row.values(), flush=True)
    return row


ABOUT = (
    "# What runs of up to a million cases cost",
    "",
    "    python benchmarks/large_runs.py -o results/large_runs",
    "",
    "Made-up answers of ten methods; every line is a process of its own, with its imports. Rows of more "
    "than 20,000 cases are Parquet, which is why 10,000 cases take longer to write and to read than "
    "100,000.",
    "",
    "![Processor time and memory over the number of cases](large_runs.png)",
    "",
)
"""The beginning of the page."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--most", type=int, default=1_000_000)
    parser.add_argument("--methods", type=int, default=10)
    parser.add_argument("--only", choices=MEASURES, action="append")
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--measure", choices=MEASURES, help=argparse.SUPPRESS)
    parser.add_argument("--root", type=Path, default=Path(), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        note = MEASURES[options.measure](options.root, options.most, options.methods)
        used = resource.getrusage(resource.RUSAGE_SELF)
        spent = f"{used.ru_utime + used.ru_stime:.2f}"
        print(json.dumps({"processor_s": spent, "peak_mb": round(used.ru_maxrss / 1e3), "note": note}))
        return
    rows = []
    cases = 1000
    while cases <= options.most:
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            rows += [measured(what, root, cases, options.methods) for what in options.only or MEASURES]
        cases *= 10
    if options.output:
        write_csv(
            options.output.with_suffix(".csv"), FIELDS, ([row[name] for name in FIELDS] for row in rows)
        )
        head = [*ABOUT, "| " + " | ".join(FIELDS) + " |", "|" + "---|" * len(FIELDS)]
        lines = ["| " + " | ".join(str(row[name]) for name in FIELDS) + " |" for row in rows]
        print("\n".join([*head, *lines]))
        draw(rows, options.output.with_suffix(".png"))


def draw(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Processor time and memory over the number of cases, both logarithmic."""
    from matplotlib import pyplot

    figure, (time_axis, memory_axis) = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for axis, name, title in (
        (time_axis, "processor_s", "processor time, seconds"),
        (memory_axis, "peak_mb", "peak memory, MB"),
    ):
        for what in dict.fromkeys(row["what"] for row in rows):
            points = [row for row in rows if row["what"] == what]
            axis.loglog(
                [row["cases"] for row in points],
                [float(row[name]) for row in points],
                marker="o",
                label=what,
            )
        axis.set(xlabel=f"cases of each of {rows[0]['methods']} methods", title=title)
        axis.grid(alpha=0.3)
    time_axis.legend()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
