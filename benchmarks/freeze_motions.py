"""Freezes the motions of ``bench check`` anew, and accepts the golden rows of all that is measured now.

    python benchmarks/freeze_motions.py --because "cases know their touches"

To be run when a frozen case should hold more than it does (a new kind of label, say); a new generator of
puppets alone is no reason, ``bench check --accept`` is enough for that. Takes about half a minute.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import Case, CaseInfo, Contacts, Dataset, Prediction
from retarget_bench.cli import main as bench
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.predict import as_scored
from retarget_bench.motion import rotation
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import registry
from retarget_bench.results.store import write_npz
from retarget_bench.verification.gate import core, frozen, golden

WINDOW = 64
"""Frames that are frozen: enough for some windows of FID."""
SMALL, LARGE = "puppets[size=tiny]", "puppets[size=default]"


# ---------------------------------------------------------------------------------------------- faults
def exact(answer: Motion) -> Prediction:
    """The right answer itself."""
    return answer


def shifted(answer: Motion) -> Prediction:
    """3 cm to the left, 2 cm up, 5 cm back."""
    return replace(answer, root=answer.root + np.array([0.03, 0.02, -0.05]))


def sunk(answer: Motion) -> Prediction:
    """23 mm down."""
    return replace(answer, root=answer.root - np.array([0.0, 0.023, 0.0]))


def turned(answer: Motion) -> Prediction:
    """Every joint turned by 7 degrees about its own X axis, the root likewise."""
    by = rotation.from_rotation_vector(np.array([np.radians(7.0), 0.0, 0.0]))
    return replace(answer, rotations=rotation.multiply(answer.rotations, by))


def sliding(answer: Motion) -> Prediction:
    """4 mm per frame along X, beginning with the motion."""
    drift = np.arange(answer.frames)[:, None] * [0.004, 0.0, 0.0]
    return replace(answer, root=answer.root + drift)


def late(answer: Motion) -> Prediction:
    """One frame late; the first frame twice."""
    return answer.at(np.maximum(np.arange(answer.frames) - 1, 0))


def shaking(answer: Motion) -> Prediction:
    """2 mm and one degree of noise in every frame, the same whenever it is made."""
    random = np.random.Generator(np.random.Philox(11))
    moved = answer.root + 0.002 * random.standard_normal(answer.root.shape)
    by = rotation.from_rotation_vector(np.radians(random.standard_normal((*answer.rotations.shape[:2], 3))))
    return replace(answer, root=moved, rotations=rotation.multiply(answer.rotations, by))


def longer(answer: Motion) -> Prediction:
    """Known by positions only, everything 3 % larger."""
    return answer.character.positions(1.03 * answer.positions, answer.fps)


FAULTS: tuple[Callable[[Motion], Prediction], ...] = (
    shifted, exact, sunk, turned, sliding, late, shaking, longer,
)  # fmt: skip


# ----------------------------------------------------------------------------------------------- files
def write(folder: Path, held: frozen.FrozenCase) -> None:
    """One file ``<name>.npz``. Raises FileError, and BenchError for what cannot be stored."""
    arrays: dict[str, np.ndarray] = {}
    parts = {"case": held.case, "predictions": held.predictions, "origin": held.origin}
    tree = json.dumps({"schema": frozen.SCHEMA, "thing": _packed(parts, arrays, {})}, allow_nan=False)
    write_npz(folder / f"{held.name}.npz", arrays | {"tree": np.array(tree)}, compressed=True)


def _packed(thing: Any, arrays: dict[str, np.ndarray], seen: dict[int, int]) -> Any:
    """An object as JSON; arrays go to ``arrays``. ``seen``: id of a dataclass -> its number in the file,
    so that those that occur more than once, such as bodies, are written once."""
    if thing is None or isinstance(thing, bool | int | float | str):
        return thing
    if isinstance(thing, np.generic):
        return thing.item()
    if id(thing) in seen:
        return {"same": seen[id(thing)]}
    if isinstance(thing, np.ndarray):
        single = thing.astype(np.float32) if thing.dtype == np.float64 else thing
        name = f"array_{len(arrays)}"
        arrays[name] = single if np.array_equal(single, thing) else thing
        return {"array": name}
    if isinstance(thing, Mapping):
        return {"mapping": {str(key): _packed(value, arrays, seen) for key, value in thing.items()}}
    if isinstance(thing, tuple | list):
        return {"tuple": [_packed(each, arrays, seen) for each in thing]}
    name = type(thing).__name__
    if frozen.DATACLASSES.get(name) is not type(thing):
        raise BenchError(f"a {name} cannot be stored among frozen motions")
    stored = thing
    if isinstance(thing, Motion):
        stored = replace(thing, rotations=thing.rotations.astype(np.float32))
    names = [each.name for each in fields(stored) if each.name not in ("measures", "skin")]
    inside = {name: _packed(getattr(stored, name), arrays, seen) for name in names}
    seen[id(thing)] = len(seen)
    return {"is": name, "fields": inside}


# ----------------------------------------------------------------------------------------------- cases
def chosen(data: Dataset, split: str, test: Callable[[CaseInfo], bool]) -> CaseInfo:
    """The first case of a split that is long enough and passes a test."""
    listed = data.cases("retarget", split)
    return next(info for info in listed if info.frames >= WINDOW and test(info))


def cases() -> dict[str, tuple[str, CaseInfo, int, tuple[Callable[[Motion], Prediction], ...]]]:
    """Name -> data set, case, how many frames of it, faults."""
    tiny, usual = registry.create("datasets", SMALL), registry.create("datasets", LARGE)
    body = {name: character.structure for name, character in tiny.characters().items()}
    return {
        "intra_walk": (SMALL, chosen(tiny, "intra", lambda i: i.kind == "walk"), 40, FAULTS),
        "cross_hands": (
            SMALL, chosen(tiny, "cross", lambda i: "touch" in i.kind), WINDOW, (shaking, turned, longer),
        ),
        "stairs": (
            SMALL, chosen(tiny, "intra", lambda i: i.kind.startswith("stairs")), WINDOW, (sunk, sliding),
        ),
        "self_dog": (
            SMALL, chosen(tiny, "self", lambda i: body[i.source] == "dog21"), WINDOW, (shaking, late),
        ),
        # the 22-joint protocols ask for more than 120 frames
        "long_body22": (
            LARGE,
            chosen(usual, "intra", lambda i: body[i.target] == "body22" and 130 < i.frames < 400),
            126,
            (turned, late),
        ),
    }  # fmt: skip


def cut(case: Case, frames: int) -> Case:
    """The frames in the middle of a case, in single precision."""
    first = max((case.source.frames - frames) // 2, 0)
    part = slice(first, first + frames)
    sides = {
        name: as_scored(side.at(part))
        for name in ("source", "reference", "alternative")
        if (side := getattr(case, name)) is not None
    }
    contacts = case.contacts
    if contacts is not None:
        pivoting = None if contacts.pivoting is None else contacts.pivoting[part]
        contacts = Contacts(contacts.roles, contacts.planted[part], pivoting)
    changes: dict[str, object] = {**sides, "contacts": contacts}
    if touches := getattr(case, "touches", None):
        changes["touches"] = tuple(replace(touch, rests=touch.rests[part]) for touch in touches)
    return replace(case, info=replace(case.info, frames=frames), **changes)


def freeze(folder: Path) -> str:
    """Writes every file; returns the lines that say where each is from."""
    rows = []
    wanted = cases()
    for old in folder.glob("*.npz"):
        if old.stem not in wanted:
            old.unlink()
    for name, (spec, info, frames, faults) in wanted.items():
        data = registry.create("datasets", spec)
        case = cut(data.load(info), frames)
        assert isinstance(case.reference, Motion)
        answers: dict[str, Prediction] = {}
        for fault in faults:
            answer = fault(case.reference)
            answers[fault.__name__] = answer if answer is case.reference else as_scored(answer)
        origin = f"{data.content}: {info.id}, {frames} frames from the middle"
        write(folder, frozen.FrozenCase(name, replace(case, alternative=None), answers, origin))
        rows.append(_row(folder, name, origin, answers))
    return "\n".join([*rows, freeze_low_hips(folder)])


def freeze_low_hips(folder: Path) -> str:
    """The motion of a frozen input as a case: no body of the puppets has hips below another joint."""
    motion = core.low_hips(folder.parent)
    body = motion.character
    info = CaseInfo("low_hips/self", "retarget", "self", body.name, body.name, "turns", "", motion.frames)
    answers = {fault.__name__: as_scored(fault(as_scored(motion))) for fault in (turned, shaking, longer)}
    origin = f"{core.INPUTS}/{core.LOW_HIPS}, all {motion.frames} frames"
    case = Case(info, as_scored(motion), body, as_scored(motion))
    write(folder, frozen.FrozenCase("low_hips", case, answers, origin))
    return _row(folder, "low_hips", origin, answers)


def _row(folder: Path, name: str, origin: str, answers: Mapping[str, Prediction]) -> str:
    size = (folder / f"{name}.npz").stat().st_size
    return f"| `{name}.npz` | {size // 1024} | {origin} | {', '.join(answers)} |"


README = """# Frozen motions

Written by `benchmarks/freeze_motions.py`; not edited by hand. Each file holds one case (source, target,
right answer, labels) and wrong answers with known faults, in single precision, so that what `bench check`
says of metrics hangs on no generator. All motion is made by this project (CC0 1.0), most by its puppets.

| file | KiB | from | predictions |
|---|---:|---|---|
{rows}

Beside its own case, the first prediction of each file is scored without labels, without a right answer, on
uneven ground, and at 24, 60 and 120 frames per second; one file's also where it is nearly still.

The predictions are made from the right answer:

{faults}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--because", required=True, help="why; it is logged")
    because = parser.parse_args().because
    folder = golden.built_in() / golden.MOTIONS
    folder.mkdir(parents=True, exist_ok=True)
    rows = freeze(folder)
    faults = "\n".join(f"- `{fault.__name__}`: {(fault.__doc__ or '').strip()}" for fault in FAULTS)
    (folder / "README.md").write_text(README.format(rows=rows, faults=faults), encoding="utf-8")
    bench(["check", "--accept", because])


if __name__ == "__main__":
    main()
