"""Facts of the core on frozen inputs, for changes that neither metrics nor methods would show.

BVH files read and written, a body whose hips are not its root, the ground, seeds, the check of answers, and
a table and a comparison made of frozen rows.
"""

import csv
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.analysis import summary
from retarget_bench.analysis.pairwise import Difference
from retarget_bench.api import INTRA, TWO_LEGS, Case
from retarget_bench.motion import bvh, ground, transfer
from retarget_bench.motion.bvh import recording
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins.prediction_check import FARTHEST, UNIT_TOLERANCE, Invalid, verified
from retarget_bench.results import result_matrix, store
from retarget_bench.tables import builder, comparing, rendering
from retarget_bench.tables.model import MARKS
from retarget_bench.tables.rendering import pairwise_text
from retarget_bench.verification.gate import frozen
from retarget_bench.verification.gate.golden import MOTIONS, Measured

INPUTS = "inputs"
"""The folder of frozen inputs, beside the golden rows."""

Rows = Iterator[tuple[str, Mapping[str, Any]]]
"""Row -> its values: numbers, texts, and curves or sequences of them (``Measured.add``)."""


def measure(now: Measured, folder: Path) -> None:
    """Add the facts of every part. What a part raises is the reason why its facts are lacking."""
    for part, rows in PARTS.items():
        try:
            for row, facts in rows(folder):
                now.add(f"{part}/{row}", facts)
        except Exception as error:  # the fault that the gate is there to find
            now.errors[part] = f"{type(error).__name__}: {error}"


# ------------------------------------------------------------------------------------------------ BVH
def reader(folder: Path) -> Rows:
    """Every BVH file: how far its quaternions are from those that it means, the rate, and the lengths."""
    with (folder / INPUTS / "rotations.csv").open(encoding="utf-8", newline="") as file:
        listed = list(csv.DictReader(file))
    for name in dict.fromkeys(row["file"] for row in listed):
        path = folder / INPUTS / name
        document = bvh.parse(path, cache=False)
        read = recording.record(path, document, root="absolute", scale=0.01, fold=False)
        meant = np.array([[float(row[k]) for k in "wxyz"] for row in listed if row["file"] == name])
        away = _away(meant.reshape(read.rotations.shape), read.rotations).max(axis=0)
        yield (
            path.stem,
            {
                "away": dict(zip(read.skeleton.names, away, strict=True)),
                "root": dict(zip("xyz", read.root[-1], strict=True)),
                "bone": read.skeleton.bone_lengths,
                "fps": read.fps,
            },
        )


def _away(meant: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """``(frames, joints)`` the largest difference of quaternions; q and -q turn alike."""
    side = np.sign((meant * turned).sum(axis=-1, keepdims=True))
    return np.asarray(np.abs(meant - side * turned).max(axis=-1))


def writer(folder: Path) -> Rows:
    """A motion written in every order of angles: the lines of its joints and what reading it loses."""
    motion = low_hips(folder)
    with tempfile.TemporaryDirectory(prefix="bench-check-") as scratch:
        for order in map("".join, permutations("XYZ")):
            path = Path(scratch) / f"{order}.bvh"
            bvh.write(path, motion, order=order, scale=100.0)
            again = bvh.read(path, root="absolute", scale=0.01, fold=False)
            head = path.read_text(encoding="utf-8").split("MOTION")[0].split("\n")
            away, root = _away(motion.rotations, again.rotations), np.abs(motion.root - again.root)
            lines = [" ".join(line.split()) for line in head if line.strip()]
            yield order, {"line": lines, "away": np.round(away.max(), 7), "root": np.round(root.max(), 7)}


# --------------------------------------------------------------------------------------------- a body
LOW_HIPS = "low_hips.bvh"
"""A body in A-pose whose hips lie below two other joints."""


def low_hips(folder: Path) -> Motion:
    """The motion of that body, from its file."""
    read = bvh.read(folder / INPUTS / LOW_HIPS, root="absolute", scale=0.01, fold=False)
    character = Character.of("low_hips", read.skeleton)
    return character.motion(read.rotations, read.root, read.fps)


def body(folder: Path) -> Rows:
    """Sizes, roles, tips and reference pose of that body, and the path of its hips."""
    motion = low_hips(folder)
    character, skeleton = motion.character, motion.skeleton
    yield "sizes", vars(character.measures)
    yield "height", {"height": character.height}
    yield "hips", {"path": transfer.hips(motion)}
    for site in skeleton.end_sites:
        yield f"tip of {skeleton.names[site.parent]}", {"offset": site.offset}
    for name, role, pose in zip(skeleton.names, character.roles, character.reference_pose, strict=True):
        # q and -q turn alike
        yield name, {"role": role or "none", "pose": pose * np.sign(pose[0] or 1.0)}


# ---------------------------------------------------------------------------------------------- floor
PLACES = {"sample": (-0.9, 0.9), "between": (0.1, 0.35), "edge": (1.7, 0.1), "beyond": (-5.0, 7.0)}
"""Places x, z on ``frozen.UNEVEN``."""


def floor(_: Path) -> Rows:
    """The height of the floor at places on, between and beyond its samples."""
    for name, (x, z) in PLACES.items():
        yield name, {"height": float(ground.ground_height(frozen.UNEVEN, np.array(x), np.array(z)))}


# ---------------------------------------------------------------------------------------------- seeds
def seeds(_: Path) -> Rows:
    """The seeds of cases, each with one thing other than the first, to the last digit."""
    inputs = {"first": (0, "one", "a>b/1"), "base": (1, "one", "a>b/1"), "method": (0, "two", "a>b/1")}
    for name, facts in (inputs | {"case": (0, "one", "a>b/2")}).items():
        yield name, {"seed": f"seed {store.case_seed(*facts)}"}


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


# ------------------------------------------------------------------------------- tables, comparisons
RESULTS = "table"
"""The results folder of the table, among the frozen inputs."""
VALUES = ("error", "ratio", "share", "pooled")
"""Values of cases; ``pooled`` counts self pairs."""
DISTANCE = "distance"
"""A value of whole sets."""


def table(folder: Path) -> Rows:
    """A table and a comparison of frozen rows, as files give them back: numbers, marks, and their text."""
    written = store.find_results(folder / INPUTS / RESULTS)
    # of bodies of one kind, so that the value of sets is a column with marks
    summaries = [replace(each, bodies=TWO_LEGS) for each in summary.split_summaries(written)]
    tables = builder.tables(summaries, (*VALUES, DISTANCE))
    matrices = [each for each in result_matrix.result_matrices(written) if each.split == INTRA]
    compared = [
        each
        for first, values in (("best", VALUES[:1]), ("near", VALUES))
        for each in comparing.compare(matrices, first, "far", values)
    ]
    (section,) = (each for each in summaries if each.split == INTRA)
    for group in (group for each in tables for group in each.groups if group.split == INTRA):
        for row in group.rows:
            for column, cell in zip(group.columns, row.cells, strict=True):
                ends = (cell.interval.low, cell.interval.high) if cell.interval else (None, None)
                ranking = section.rankings.get(column.id)
                p = ranking.p.get(row.label) if ranking else None
                numbers = {"mean": cell.value, "low": ends[0], "high": ends[1], "place": cell.place, "p": p}
                columns = {name: each for name, each in numbers.items() if each is not None}
                yield f"{row.label} {column.id}", {**columns, "mark": list(MARKS).index(cell.mark)}
        yield "floors", {"floor": [note for note in group.below if note.startswith("Floor")]}
    for both in compared:
        for each in both.differences:
            yield f"{both.first}, {both.second} {each.value}", _difference(each)
    yield "text", _drawn(rendering.text(tables, intervals=True))
    yield "comparison", _drawn(pairwise_text.text(compared, 100))
    yield "default columns", {"id": builder.DEFAULT_COLUMNS}
    yield "first table", {"id": builder.OVERVIEW_COLUMNS}


def _difference(one: Difference) -> dict[str, Any]:
    facts = ("difference", "p", "adjusted", "cases", "clips", "won", "verdict")
    between = [one.interval.low, one.interval.high] if one.interval else []
    return {name: getattr(one, name) for name in facts} | {"interval": between}


def _drawn(text: str) -> dict[str, list[str]]:
    """The lines of the paragraphs with numbers; sentences around them may change."""
    return {"line": [line for each in text.split("\n\n") if "↓" in each for line in each.splitlines()]}


PARTS: Mapping[str, Callable[[Path], Rows]] = {
    "reader": reader,
    "writer": writer,
    "body": body,
    "floor": floor,
    "seeds": seeds,
    "refusals": refusals,
    "table": table,
}
