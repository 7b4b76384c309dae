"""Parts of the core on frozen inputs, where no motion and no method would show that they changed.

The reader of BVH files, the ground, seeds, the check of answers, and means, intervals and marks of a table.
"""

import csv
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from retarget_bench.analysis import summary
from retarget_bench.api import Case, CaseInfo, Direction
from retarget_bench.motion import bvh, ground
from retarget_bench.motion.bvh import recording
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins.prediction_check import FARTHEST, UNIT_TOLERANCE, Invalid, verified
from retarget_bench.results import store
from retarget_bench.results.header import Counts, DatasetInfo, DeclaredValue, MethodInfo, ResultHeader
from retarget_bench.results.store import CaseResult, ResultPaths
from retarget_bench.tables import builder
from retarget_bench.tables.model import MARKS
from retarget_bench.verification.gate import frozen
from retarget_bench.verification.gate.golden import MOTIONS, Snapshot

INPUTS = "inputs"
"""The folder of frozen inputs, beside the golden rows."""
TOLERANCE = 1e-9

Rows = Iterator[tuple[str, Mapping[str, float]]]
"""Row -> column -> number."""


def measure(found: Snapshot, folder: Path) -> None:
    """Add the rows of every part. What a part raises is the failure of its rows."""
    for part, rows in PARTS.items():
        try:
            for row, columns in rows(folder):
                found.frozen[f"{part}/{row}"] = {f"{part}.{key}": each for key, each in columns.items()}
        except Exception as error:  # the fault that the gate is there to find
            found.failures[part] = f"{type(error).__name__}: {error}"
    measured = {key.split("@", 1)[0] for row in found.frozen.values() for key in row}
    for value in sorted(measured - found.values.keys()):
        facts = {"metric": value.split(".", 1)[0], **frozen.PLAIN, "tolerance": TOLERANCE}
        found.values[value] = facts


# --------------------------------------------------------------------------------------------- reader
def reader(folder: Path) -> Rows:
    """Every BVH file: how far its quaternions are from those that it means, the rate, and the lengths."""
    with (folder / INPUTS / "rotations.csv").open(encoding="utf-8", newline="") as file:
        listed = list(csv.DictReader(file))
    for path in sorted((folder / INPUTS).glob("*.bvh")):
        document = bvh.parse(path, cache=False)
        read = recording.record(path, document, root="absolute", scale=0.01, fold=False)
        meant = np.array([[float(row[k]) for k in "wxyz"] for row in listed if row["file"] == path.name])
        meant = meant.reshape(read.rotations.shape)
        side = np.sign((meant * read.rotations).sum(axis=-1, keepdims=True))  # q and -q turn alike
        away = np.abs(meant - side * read.rotations).max(axis=(0, 2))
        yield (
            path.stem,
            {
                **{
                    f"away@{name}": float(each)
                    for name, each in zip(read.skeleton.names, away, strict=True)
                },
                **{f"root@{axis}": float(each) for axis, each in zip("xyz", read.root[-1], strict=True)},
                **{f"bone@{n}": float(each) for n, each in enumerate(read.skeleton.bone_lengths)},
                "fps": read.fps,
            },
        )


# ---------------------------------------------------------------------------------------------- floor
PLACES = {"sample": (-0.9, 0.9), "between": (0.1, 0.35), "edge": (1.7, 0.1), "beyond": (-5.0, 7.0)}
"""Places x, z on ``frozen.UNEVEN``."""


def floor(_: Path) -> Rows:
    """The height of the floor at places on, between and beyond its samples."""
    for name, (x, z) in PLACES.items():
        height = ground.ground_height(frozen.UNEVEN, np.array(x), np.array(z))
        yield name, {"height": float(height)}


# ---------------------------------------------------------------------------------------------- seeds
def seeds(_: Path) -> Rows:
    """The seeds of cases, each with one thing other than the first."""
    asked = {"first": (0, "one", "a>b/1"), "base": (1, "one", "a>b/1"), "method": (0, "two", "a>b/1")}
    for name, facts in (asked | {"case": (0, "one", "a>b/2")}).items():
        yield name, {"seed": float(store.case_seed(*facts))}


# ------------------------------------------------------------------------------------------- refusals
def refusals(folder: Path) -> Rows:
    """Answers to a frozen case: 1 where one is refused, 0 where it is taken."""
    case = frozen.read(folder / MOTIONS / "intra_walk.npz").case
    for name, answer in _answers(case):
        try:
            verified(answer, case)
        except Invalid:
            yield name, {"refused": 1.0}
        else:
            yield name, {"refused": 0.0}


def _answers(case: Case) -> Iterator[tuple[str, object]]:
    answer = case.reference
    assert isinstance(answer, Motion)
    root, turned, places = answer.root.copy(), answer.rotations.copy(), answer.positions.copy()
    root[3, 1] = turned[3, 2, 0] = places[3, 2, 1] = np.nan
    yield "right", answer
    yield "none", None
    yield "nan in root", replace(answer, root=root)
    yield "nan in rotations", replace(answer, rotations=turned)
    yield "nan in positions", case.target.positions(places, answer.fps)
    yield "infinite", replace(answer, root=np.where(np.isnan(root), np.inf, root))
    yield "fps double", replace(answer, fps=2 * answer.fps)
    yield "fps a thousandth more", replace(answer, fps=1.001 * answer.fps)
    yield "fps as printed", replace(answer, fps=(1 + 5e-7) * answer.fps)
    yield "a frame less", answer.at(slice(1, None))
    yield "another body", case.source
    for share in (0.9, 1.1):
        yield f"place {share} of the farthest", replace(answer, root=answer.root * 0 + share * FARTHEST)
        by = 1 + share * UNIT_TOLERANCE
        yield f"length {share} of the tolerance off", replace(answer, rotations=by * answer.rotations)


# ---------------------------------------------------------------------------------------------- table
SIDES: Mapping[str, Direction] = {"error": "lower", "ratio": "target"}
VALUES = {
    key: DeclaredValue(
        label=key, meaning="", unit="1", better=better, goal=1.0, tolerance=1e-6, index="", with_self=False
    )
    for key, better in SIDES.items()
}


def table(folder: Path) -> Rows:
    """The cells of a table made of frozen rows, as files give them back, and the p-values behind marks."""
    with (folder / INPUTS / "table.csv").open(encoding="utf-8", newline="") as file:
        listed = list(csv.DictReader(file))
    methods = dict.fromkeys(row["method"] for row in listed)
    with tempfile.TemporaryDirectory(prefix="bench-check-") as root:
        written = [
            _stored(Path(root), method, [row for row in listed if row["method"] == method])
            for method in methods
        ]
        (section,) = summary.split_summaries(written)
    ((group,),) = (made.groups for made in builder.tables([section], tuple(VALUES)))
    for row in group.rows:
        for key, cell in zip(VALUES, row.cells, strict=True):
            ends = (cell.interval.low, cell.interval.high) if cell.interval else (None, None)
            p = section.rankings[key].p.get(row.label)
            numbers = {"mean": cell.value, "low": ends[0], "high": ends[1], "place": cell.place, "p": p}
            columns = {name: float(each) for name, each in numbers.items() if each is not None}
            yield f"{row.label} {key}", {**columns, "mark": float(list(MARKS).index(cell.mark))}


def _stored(root: Path, method: str, listed: list[dict[str, str]]) -> ResultPaths:
    """The result files of a method."""
    infos, entries = [], []
    for row in listed:
        source, target = row["pair"].split(">")
        case = f"frozen/{row['pair']}/{row['clip']}"
        infos.append(CaseInfo(case, "retarget", "cross", source, target, row["clip"], "", 10))
        values: store.Values = {key: float(row[key]) for key in VALUES if row[key]}
        entries.append(CaseResult(case, "ok" if values else "failed", values=values))
    header = ResultHeader(
        keys={},
        split="cross",
        method=MethodInfo(label=method, privileged=(), control=method == "control"),
        dataset=DatasetInfo(label="frozen", content="frozen", notes=()),
        metrics={},
        values=VALUES,
        counts=Counts.of(entry.status for entry in entries),
        problems=(),
    )
    paths = ResultPaths(root, "frozen", "retarget", "cross", method)
    store.write_results(paths, header, entries, infos)
    return paths


PARTS: Mapping[str, Callable[[Path], Rows]] = {
    "reader": reader,
    "floor": floor,
    "seeds": seeds,
    "refusals": refusals,
    "table": table,
}
