"""What is known of a split's cases beyond the case list: joints by part of the body, and what is unseen.

Two small files lie beside ``cases.csv``. Results written before there were any load without them.

    cases.parts.csv    target, joint, part of the body (``retarget_bench.motion.roles.BODY_PARTS``)
    cases.unseen.csv   case, and which of source, target and kind no training part of the data has
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from retarget_bench import records
from retarget_bench.api import CaseInfo, Dataset
from retarget_bench.files import atomic
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import body_part
from retarget_bench.records import Place

PARTS_FIELDS = ("target", "joint", "part")
UNSEEN_FIELDS = ("case", "unseen")


def write(place: Place, data: Dataset, infos: Sequence[CaseInfo]) -> None:
    """The marks of a split. A data set that does not say what its training part has gets no second file."""
    bodies = data.characters()
    targets = sorted({info.target for info in infos} & set(bodies))
    rows = [(name, joint, part) for name in targets for joint, part in parts(bodies[name]).items()]
    _write(_parts_path(place), PARTS_FIELDS, rows)
    unseen = getattr(data, "unseen", None)
    if unseen is None:
        _unseen_path(place).unlink(missing_ok=True)
    else:
        marks = [(info.id, "+".join(sorted(unseen(info)))) for info in infos]
        _write(_unseen_path(place), UNSEEN_FIELDS, sorted(marks))


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


def read_parts(place: Place) -> dict[tuple[str, str], str] | None:
    """(target, joint) -> part of the body; None where the results are older than these marks."""
    path = _parts_path(place)
    if not path.exists():
        return None
    return {(target, joint): part for target, joint, part in records.read_csv(path, PARTS_FIELDS)}


def read_unseen(place: Place) -> dict[str, frozenset[str]] | None:
    """Case -> what of it the data set's training part does not have; None where it does not say."""
    path = _unseen_path(place)
    if not path.exists():
        return None
    rows = records.read_csv(path, UNSEEN_FIELDS)
    return {case: frozenset(words.split("+")) if words else frozenset() for case, words in rows}


def not_in(manifest: Mapping[str, Sequence[str]], info: CaseInfo) -> frozenset[str]:
    """What of a case a training manifest does not have, out of ``source``, ``target`` and ``kind``.

    The motion counts as known where training had its kind, or, where kinds are not known, its clip.
    """
    kinds = bool(info.kind) and "kinds" in manifest
    known = {
        "source": info.source in manifest.get("characters", ()),
        "target": info.target in manifest.get("characters", ()),
        "kind": info.kind in manifest["kinds"] if kinds else info.clip in manifest.get("clips", ()),
    }
    return frozenset(word for word, there in known.items() if not there)


def _parts_path(place: Place) -> Path:
    return place.folder / "cases.parts.csv"


def _unseen_path(place: Place) -> Path:
    return place.folder / "cases.unseen.csv"


def _write(path: Path, fields: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    with atomic(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(fields)
        writer.writerows(rows)
