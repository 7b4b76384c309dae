"""Metadata of the cases of a split: structures, heights, body parts, unseen bodies and kinds, conditions.

Small files lie beside ``cases.csv``. Results written before there were any load without them.

    cases.parts.csv    target, joint, part of the body (``retarget_bench.motion.roles.BODY_PARTS``)
    cases.structures.csv  target, structure
    cases.heights.csv  target, its height: the metres that errors are divided by
    cases.bodies.csv   source or target, number of its legs
    cases.unseen.csv   case, and which of source, target and kind no training part of the data has
    cases.conditions.csv  of derived tasks: case, condition (``noise``), number
    cases.sums.csv     which of these files, its SHA-256 and its rows
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from retarget_bench.api import CaseInfo, Dataset
from retarget_bench.api.optional import OffersConditions, OffersUnseen
from retarget_bench.errors import FileError
from retarget_bench.files import write_csv
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import body_part
from retarget_bench.results import checksums, store
from retarget_bench.results.header import StoredFile
from retarget_bench.results.store import ResultPaths

FIELDS = {
    "parts": ("target", "joint", "part"),
    "structures": ("target", "structure"),
    "heights": ("target", "height"),
    "bodies": ("character", "legs"),
    "unseen": ("case", "unseen"),
    "conditions": ("case", "condition", "value"),
}
SUMS = ("file", "sha256", "rows")


def write(paths: ResultPaths, data: Dataset, infos: Sequence[CaseInfo]) -> None:
    """The metadata of a split: a file of each kind that the data set knows."""
    bodies = data.characters()
    targets = sorted({info.target for info in infos} & set(bodies))
    known = sorted(({info.source for info in infos} & set(bodies)).union(targets))
    rows: dict[str, list[tuple[str, ...]]] = {
        "parts": [(name, joint, part) for name in targets for joint, part in parts(bodies[name]).items()],
        "structures": [(name, bodies[name].structure) for name in targets],
        "heights": [(name, f"{bodies[name].height:.12g}") for name in targets],
        "bodies": [(name, "4" if bodies[name].four_legged else "2") for name in known],
    }
    if isinstance(data, OffersUnseen):
        rows["unseen"] = sorted((info.id, "+".join(sorted(data.unseen(info)))) for info in infos)
    if isinstance(data, OffersConditions):
        said = ((info.id, name, number) for info in infos for name, number in data.conditions(info).items())
        rows["conditions"] = sorted((case, name, f"{number:.9g}") for case, name, number in said)
    _sums_path(paths).unlink(missing_ok=True)
    sums = []
    for kind, fields in FIELDS.items():
        if kind in rows:
            write_csv(_path(paths, kind), fields, rows[kind])
            stored = checksums.stored_file(_path(paths, kind))
            sums.append((kind, stored.sha256, stored.rows))
        else:
            _path(paths, kind).unlink(missing_ok=True)
    write_csv(_sums_path(paths), SUMS, sums)


def damaged(paths: ResultPaths) -> bool:
    """True where a file is missing or not as it was written, and where results are older than the file of
    heights; those without checksums are not looked at."""
    try:
        found = _problems(paths)
    except FileError:
        return True
    return any(found.values()) or (bool(found) and "heights" not in found)


def parts(body: Character) -> dict[str, str]:
    """Joint -> part of the body. Joints without a role go with the joint that carries them."""
    parents = body.skeleton.parents.tolist()
    found = {}
    for joint, name in enumerate(body.skeleton.names):
        while joint >= 0 and body.roles[joint] is None:
            joint = parents[joint]
        role = body.roles[joint] if joint >= 0 else None
        found[name] = body_part(role) if role else "trunk"
    return found


def read_parts(paths: ResultPaths) -> dict[tuple[str, str], str] | None:
    """(target, joint) -> part of the body; None where the results are older than this file."""
    rows = _rows(paths, "parts")
    return None if rows is None else {(target, joint): part for target, joint, part in rows}


def read_unseen(paths: ResultPaths) -> dict[str, frozenset[str]] | None:
    """Case -> what of it the data set's training part does not have; None where it does not say."""
    rows = _rows(paths, "unseen")
    return None if rows is None else {case: frozenset(filter(None, text.split("+"))) for case, text in rows}


def read_structures(paths: ResultPaths) -> dict[str, str] | None:
    """Target -> its structure; None where the results are older than this file."""
    rows = _rows(paths, "structures")
    return None if rows is None else dict(rows)


def read_heights(paths: ResultPaths) -> dict[str, float] | None:
    """Target -> its height in metres; None where the results are older than this file. Raises FileError."""
    rows = _rows(paths, "heights")
    if rows is None:
        return None
    path = _path(paths, "heights")
    return {target: _number(path, line, text) for line, (target, text) in enumerate(rows, 2)}


def read_legs(paths: ResultPaths) -> dict[str, str] | None:
    """Source or target -> ``2`` or ``4`` legs; None where the results are older than this file."""
    rows = _rows(paths, "bodies")
    return None if rows is None else dict(rows)


def read_conditions(paths: ResultPaths) -> dict[str, dict[str, float]]:
    """Case -> condition -> number; empty where the task has none. Raises FileError."""
    found: dict[str, dict[str, float]] = {}
    path = _path(paths, "conditions")
    for line, (case, name, text) in enumerate(_rows(paths, "conditions") or (), 2):
        found.setdefault(case, {})[name] = _number(path, line, text)
    return found


def _number(path: Path, line: int, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise FileError(path, f"{text!r} is not a number", line) from None


def _rows(paths: ResultPaths, kind: str) -> list[list[str]] | None:
    path = _path(paths, kind)
    if problem := _problems(paths).get(kind):
        raise FileError(path, f"{problem}; groups of cases could be wrong. bench run writes it anew")
    return store.read_csv(path, FIELDS[kind]) if path.exists() else None


def _problems(paths: ResultPaths) -> dict[str, str]:
    """Kind of file -> how it differs from what was written, "" where it does not."""
    path = _sums_path(paths)
    if not path.exists():
        return {}
    sums = {}
    for line, (kind, sha256, rows) in enumerate(store.read_csv(path, SUMS), 2):
        if kind not in FIELDS or not rows.isdecimal():
            raise FileError(path, "is no list of checksums; bench run writes it anew", line)
        sums[kind] = StoredFile(sha256=sha256, rows=int(rows))
    return {kind: checksums.problem(_path(paths, kind), each) for kind, each in sums.items()}


def not_in(manifest: Mapping[str, Sequence[str]], info: CaseInfo) -> frozenset[str]:
    """The parts of a case that a training manifest lacks, out of ``source``, ``target`` and ``kind``.

    The motion counts as known where training had its kind, or, where kinds are not known, its clip.
    """
    kinds = bool(info.kind) and "kinds" in manifest
    known = {
        "source": info.source in manifest.get("characters", ()),
        "target": info.target in manifest.get("characters", ()),
        "kind": info.kind in manifest["kinds"] if kinds else info.clip in manifest.get("clips", ()),
    }
    return frozenset(word for word, there in known.items() if not there)


def _sums_path(paths: ResultPaths) -> Path:
    return paths.folder / "cases.sums.csv"


def _path(paths: ResultPaths, what: str) -> Path:
    return paths.folder / f"cases.{what}.csv"
