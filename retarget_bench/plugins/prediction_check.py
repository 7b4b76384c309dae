"""Checking answers: whether what a method or post-processor returned is a motion of the case's target."""

from dataclasses import replace

import numpy as np

from retarget_bench.api import Case, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.motion.motion import Motion, Positions, Surface

FARTHEST = 1e5
"""Metres from the origin beyond which no prediction is taken seriously."""
UNIT_TOLERANCE = 1e-3
"""Largest difference from 1 of the length of a predicted quaternion, which is then normalised."""
_NAMES = {"rotations": "rotation", "root": "root position", "positions": "position", "vertices": "vertex"}
"""Arrays of predictions, in messages."""
EMPTY = "there is nothing to answer: the source has no frames"


class Invalid(BenchError):
    """A prediction that does not answer its case."""


def verified(answer: object, case: Case) -> Prediction:
    """The answer, if it is a motion of the case's target with its frames and rate; else Invalid."""
    if not case.source.frames:
        raise Invalid(EMPTY)
    if not isinstance(answer, Motion | Positions | Surface):
        raise Invalid(
            f"returned a {type(answer).__name__}; return target.motion(...), target.positions(...) or "
            "target.surface(...)"
        )
    if not answer.skeleton.same_as(case.target.skeleton):
        raise Invalid(
            f"returned a motion of {answer.character.name!r} with {len(answer.skeleton)} joints; the "
            f"target is {case.target.name!r} with {len(case.target.skeleton)} joints and its own bones"
        )
    if answer.frames != case.source.frames:
        raise Invalid(f"returned {answer.frames} frames; the source has {case.source.frames}")
    if abs(answer.fps - case.source.fps) > 1e-6 * case.source.fps:
        raise Invalid(f"returned {answer.fps:g} frames per second; the source has {case.source.fps:g}")
    if isinstance(answer, Surface):
        _check_vertices(answer, case)
    for name, values in ((_NAMES[name], getattr(answer, name)) for name in answer.arrays):
        bad = ~np.isfinite(values.reshape(len(values), -1)).all(axis=1)
        if bad.any():
            raise Invalid(
                f"returned {int(bad.sum())} frames with a {name} that is not finite, "
                f"the first being frame {int(bad.argmax())}"
            )
    placed = answer.root if isinstance(answer, Motion) else getattr(answer, answer.arrays[0])
    farthest = np.abs(placed).max(initial=0.0)
    if farthest > FARTHEST:
        raise Invalid(f"returned positions up to {farthest:.3g} m away; lengths are in metres")
    if isinstance(answer, Motion):
        lengths = np.linalg.norm(answer.rotations, axis=-1)
        if (worst := np.abs(lengths - 1).max(initial=0.0)) > UNIT_TOLERANCE:
            raise Invalid(f"returned quaternions that are not unit (length off by up to {worst:.3g})")
    return replace(answer, character=case.target)


def _check_vertices(answer: Surface, case: Case) -> None:
    """Raises Invalid for vertices that are not those of the target's mesh."""
    mesh = case.target.mesh
    if mesh is None:
        raise Invalid(f"returned vertices, and {case.target.name!r} has no mesh")
    if answer.vertices.shape[1] != len(mesh.vertices):
        raise Invalid(
            f"returned {answer.vertices.shape[1]} vertices; the mesh of {case.target.name!r} has "
            f"{len(mesh.vertices)}"
        )
