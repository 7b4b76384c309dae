"""Metadata of the cases of a split: structures, heights, legs, body parts, what is unseen, conditions.

A file beside ``cases.csv`` has a row for every fact: its kind, the character or case that it is of, a joint
or condition where it is of one, and the fact. The last row has the hash of those before it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from retarget_bench.api import CaseInfo, Dataset
from retarget_bench.errors import FileError
from retarget_bench.files import digest, write_csv
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import body_part
from retarget_bench.results.paths import ResultPaths
from retarget_bench.results.rows import read_csv

FIELDS = ("fact", "of", "index", "value")
STRUCTURE, HEIGHT, LEGS, PART = "structure", "height", "legs", "part"
UNSEEN, CONDITION = "unseen", "condition"
HASH = "hash"


@dataclass(frozen=True)
class CaseMetadata:
    """Metadata of the cases of a split beside the case list; empty where nothing is known.

    structures: target -> its structure.
    heights:    target -> its height in metres: what errors are divided by.
    legs:       source or target -> the number of its legs, ``2`` or ``4``.
    parts:      target -> joint -> part of the body (``retarget_bench.motion.roles.BODY_PARTS``).
    unseen:     case -> which of ``source``, ``target`` and ``kind`` no training part of the data has; None
                where the data set does not say.
    conditions: of derived tasks, case -> condition (``noise``) -> number.
    """

    structures: Mapping[str, str] = field(default_factory=dict)
    heights: Mapping[str, float] = field(default_factory=dict)
    legs: Mapping[str, str] = field(default_factory=dict)
    parts: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    unseen: Mapping[str, frozenset[str]] | None = None
    conditions: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


def write(paths: ResultPaths, data: Dataset, infos: Sequence[CaseInfo]) -> None:
    """The metadata of a split, as far as the data set knows them."""
    bodies = data.characters()
    targets = sorted({info.target for info in infos} & set(bodies))
    characters = sorted(({info.source for info in infos} & set(bodies)).union(targets))
    facts = [(LEGS, name, "", "4" if bodies[name].four_legged else "2") for name in characters]
    for name in targets:
        facts.append((STRUCTURE, name, "", bodies[name].structure))
        facts.append((HEIGHT, name, "", f"{bodies[name].height:.12g}"))
        facts += [(PART, name, joint, part) for joint, part in parts(bodies[name]).items()]
    for info in sorted(infos, key=lambda info: info.id):
        if (unseen := data.unseen(info)) is not None:
            facts.append((UNSEEN, info.id, "", "+".join(sorted(unseen))))
        numbers = sorted(data.conditions(info).items())
        facts += [(CONDITION, info.id, name, f"{number:.9g}") for name, number in numbers]
    write_facts(paths, facts)


def write_facts(paths: ResultPaths, facts: Sequence[Sequence[str]]) -> None:
    """Rows of the file, below which their hash is written."""
    write_csv(path_of(paths), FIELDS, [*facts, (HASH, "", "", _hash(facts))])


def damaged(paths: ResultPaths) -> bool:
    """Whether the metadata of results that are there are missing or not as they were written."""
    try:
        read(paths)
    except FileError:
        return True
    return paths.cases.exists() and not path_of(paths).exists()


def path_of(paths: ResultPaths) -> Path:
    return paths.folder / "cases.metadata.csv"


def parts(body: Character) -> dict[str, str]:
    """Joint -> part of the body. Joints without a role go with the joint that carries them."""
    parents = body.skeleton.parents.tolist()
    part_of = {}
    for joint, name in enumerate(body.skeleton.names):
        while joint >= 0 and body.roles[joint] is None:
            joint = parents[joint]
        role = body.roles[joint] if joint >= 0 else None
        part_of[name] = body_part(role) if role else "trunk"
    return part_of


def read(paths: ResultPaths) -> CaseMetadata:
    """The metadata of the cases of results. Raises FileError where they are not as they were written."""
    path = path_of(paths)
    return _read(path, path.stat().st_mtime_ns) if path.exists() else CaseMetadata()


@lru_cache(maxsize=64)
def _read(path: Path, changed: int) -> CaseMetadata:
    """Metadata that all methods on a split share."""
    del changed
    *rows, last = read_csv(path, FIELDS) or [[]]
    try:
        if last == [HASH, "", "", _hash(rows)]:
            return _parsed(rows)
    except ValueError:
        pass  # not a number: another program wrote it
    raise FileError(
        path, "is not as it was written; groups of cases could be wrong. bench run writes it anew"
    )


def _parsed(rows: Iterable[Sequence[str]]) -> CaseMetadata:
    """Raises ValueError for a text that is no number."""
    facts: dict[str, dict[str, dict[str, str]]] = {}
    for fact, of, index, value in rows:
        facts.setdefault(fact, {}).setdefault(of, {})[index] = value
    plain = {fact: {of: each.get("", "") for of, each in all_of.items()} for fact, all_of in facts.items()}
    unseen = {case: frozenset(filter(None, t.split("+"))) for case, t in plain.get(UNSEEN, {}).items()}
    return CaseMetadata(
        structures=plain.get(STRUCTURE, {}),
        heights={name: float(text) for name, text in plain.get(HEIGHT, {}).items()},
        legs=plain.get(LEGS, {}),
        parts=facts.get(PART, {}),
        unseen=unseen if UNSEEN in facts else None,
        conditions={
            case: {name: float(text) for name, text in each.items()}
            for case, each in facts.get(CONDITION, {}).items()
        },
    )


def _hash(rows: Iterable[Sequence[str]]) -> str:
    return digest("\n".join("\0".join(row) for row in rows), 32)


def not_in(manifest: Mapping[str, Sequence[str]], info: CaseInfo) -> frozenset[str]:
    """The parts of a case that a training manifest lacks, out of ``source``, ``target`` and ``kind``.

    The motion counts as known where training had its kind, or, where kinds are not known, its clip.
    """
    kinds = bool(info.kind) and "kinds" in manifest
    trained = {
        "source": info.source in manifest.get("characters", ()),
        "target": info.target in manifest.get("characters", ()),
        "kind": info.kind in manifest["kinds"] if kinds else info.clip in manifest.get("clips", ()),
    }
    return frozenset(word for word, there in trained.items() if not there)
