"""Writes the files of the frozen corpus (``frozen.py``) anew, from what the generator makes.

    python -m retarget_bench.datasets.puppets.generator.corpus.freezing

It takes a minute; ``tests/datasets/freeze_puppets.py`` does it among all else that is frozen.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, get_args

import numpy as np

from retarget_bench.api import SPLITS, Touch

from ... import archives
from ...contract import USUAL, VERSION, Part, Size
from ...frozen import FOLDER, PREFIX, columns
from ..bodies.meshes import skin
from ..bodies.structures import Body
from ..conventions import FPS
from ..solver.reach import ground
from .cases import clip_action, performers
from .clip_solver import ClipSolver, own_rests, self_touches, touches
from .clips import Clip, clips
from .families import HELD_OUT_KINDS, everybody, families, only_tested
from .generated import Generated

SIZE: Size = "tiny"
SEED = 0
Arrays = dict[str, np.ndarray]
Facts = dict[str, Any]


def write(folder: Path = FOLDER) -> None:
    """All files of the corpus; its test part is where most of the motion is."""
    parts = {part: Generated(SIZE, part, SEED) for part in get_args(Part)}
    solver = parts["test"].solver
    cast = everybody()
    trained = [
        (clip, name)
        for characters in parts["test"].training().values()
        for name, clips in characters.items()
        for clip in clips.listed
    ]
    arrays = {part: _part(corpus) for part, corpus in parts.items()}
    arrays["training"] = _merged(_take(solver, clip, {name: False}) for clip, name in trained)
    arrays["bodies"] = _merged(_body(solver, body) for body in cast.values())
    arrays["skins"] = _merged(_skin(body) for body in cast.values())
    index = {
        "generator": VERSION,
        "fps": FPS,
        "held_out": HELD_OUT_KINDS,
        "structures": {body.structure.name: _structure(solver, body) for body in cast.values()},
        "bodies": {
            name: {"structure": body.structure.name, "family": family.name, "held_out": only_tested(body)}
            for family in families()
            for name, body in family.bodies.items()
        },
        **{part: _facts(corpus) for part, corpus in parts.items()},
        "training": {
            structure: {
                name: {clip.name: clip.frames for clip in clips.listed}
                for name, clips in characters.items()
            }
            for structure, characters in parts["test"].training().items()
        },
        "manifest": parts["test"].training_manifest(),
    }
    archives.write(folder, arrays, index)


def _merged(parts: Iterable[Arrays]) -> Arrays:
    return {name: array for part in parts for name, array in part.items()}


# ------------------------------------------------------------------------------------------ bodies
@cache
def _hands() -> Mapping[str, tuple[str, str]]:
    """Label -> side of a hand and place of the own body on which it rests in some clip."""
    listed = [clip for part in get_args(Part) for clip in clips(SIZE, SEED, part)]
    hands = dict.fromkeys(hand for clip in listed for hand in own_rests(clip.score()))
    return {f"{side} hand on {place}": (side, place) for side, place in hands}


def _touches(body: Body) -> dict[str, Touch]:
    """Label -> the touch in cases; without those on places whose joints the body lacks."""
    rests = np.zeros(0, dtype=bool)
    by_label = {label: self_touches({hand: rests}, body) for label, hand in _hands().items()}
    return {label: touch for label, touches in by_label.items() for touch in touches}


def _structure(solver: ClipSolver, body: Body) -> Facts:
    skeleton = solver.cast[body.name].skeleton
    return {
        "joints": skeleton.names,
        "parents": skeleton.parents.tolist(),
        "ends": [site.parent for site in skeleton.end_sites],
        "roles": body.structure.roles,
        "contacts": body.structure.labelled,
        "touches": {label: [touch.end, touch.bearing] for label, touch in _touches(body).items()},
    }


def _body(solver: ClipSolver, body: Body) -> Arrays:
    character, touched = solver.cast[body.name], _touches(body).values()
    return {
        f"{body.name} offsets": character.skeleton.offsets,
        f"{body.name} ends": np.array([site.offset for site in character.skeleton.end_sites]),
        f"{body.name} pose": character.reference_pose,
        f"{body.name} touches": np.array([(touch.point, touch.place) for touch in touched]),
    }


def _skin(body: Body) -> Arrays:
    vertices, faces, volume = skin(body)
    return {
        f"{body.name} vertices": vertices,
        f"{body.name} faces": faces.astype(np.uint16),
        f"{body.name} start": volume.start,
        f"{body.name} line": volume.line,
        f"{body.name} radii": volume.radii,
        f"{body.name} follows": volume.follows,
        f"{body.name} spread": np.array(volume.spread),
    }


# ------------------------------------------------------------------------------------------- clips
def _facts(corpus: Generated) -> Facts:
    """A part's lists."""
    listed = {split: corpus.cases(split) for split in SPLITS} | {"legs": corpus.between_legs()}
    return {
        "clips": {clip.name: _clip(clip) for clip in clips(SIZE, SEED, corpus.part)},
        "cases": {name: [info.id.removeprefix(PREFIX) for info in infos] for name, infos in listed.items()},
        "exclusions": corpus.exclusions(),
    }


def _clip(clip: Clip) -> Facts:
    score = clip.score()
    return {
        "kind": clip.kind,
        "frames": clip.frames,
        "action": clip_action(clip),
        "flat": score.stairs is None,
        "stretches": [[act.kind, act.end - act.first] for act in score.stretches()],
        "touches": [*touches(score)],
    }


def _part(corpus: Generated) -> Arrays:
    """All arrays of the clips of a part."""
    arrays: Arrays = {}
    for clip, bodies in performers(SIZE, corpus.part, SEED).items():
        score, rests = clip.score(), touches(clip.score())
        arrays |= _take(corpus.solver, clip, bodies)
        arrays[f"{clip.name} phases"] = np.asarray(score.phases(), dtype=np.float64)
        if rests:
            arrays[f"{clip.name} touches"] = np.stack([*rests.values()])
        for name in bodies if score.stairs else ():
            floor = ground(score, clip.family.bodies[name])
            assert floor.heights is not None
            arrays[f"{clip.name} {name} heights"] = floor.heights
            arrays[f"{clip.name} {name} grid"] = np.array([*floor.origin, floor.spacing])
    return arrays


def _take(solver: ClipSolver, clip: Clip, bodies: Mapping[str, bool]) -> Arrays:
    """The motions of a clip (``frozen.Take``). bodies: body -> whether there is a second answer."""
    held = columns(bodies)
    motions = [solver.solved(clip, name, manner, measured=False) for name, manner in held]
    usual = [each for each, (_, manner) in zip(motions, held, strict=True) if manner == USUAL]
    labels = [np.stack([each["planted"], each["pivoting"]]) for each in usual]
    return {
        f"{clip.name} rotations": np.concatenate(
            [np.moveaxis(each["rotations"], 0, -1) for each in motions]
        ),
        f"{clip.name} roots": np.stack([each["root"].T for each in motions]),
        f"{clip.name} contacts": np.concatenate([np.moveaxis(each, -1, 0) for each in labels]),
    }


if __name__ == "__main__":
    write()
