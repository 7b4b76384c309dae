"""Joints below the root that move against their parents, which bones of constant length cannot do.

A reader gives such a motion as ``Recording.places`` beside rotations and a skeleton whose bones have one
length each (``recording.resting``). ``settled`` then drops these places, bakes them into rotations, or
keeps them beside the motion for a file of the same body.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion, Positions
from retarget_bench.motion.fitting import fit

Way = Literal["auto", "drop", "bake", "keep"]
NOT_KEPT = "positions of inner joints are left out: a new file has bones of constant length"
_SMALL = 0.03
"""Share of the body's height by which dropped places may move a joint that has a role, unless told."""


@dataclass(frozen=True, eq=False)
class Settled:
    """A motion of constant bones; what to say of it as a matter of course, and as a doubt; the ``(frames,
    joints, 3)`` places in their parents' frames, metres, where they are kept; and what was dropped unasked,
    in words, without advice."""

    motion: Motion
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    places: np.ndarray | None = None
    dropped: str = ""


def positions(motion: Motion, places: np.ndarray) -> np.ndarray:
    """``(frames, joints, 3)`` metres in the world of joints turned as in the motion, standing at
    ``places`` ``(frames, joints, 3)`` in their parents' frames."""
    turned = motion.global_rotations
    world = np.empty_like(places)
    world[:, 0] = motion.root
    for joint, parent in enumerate(motion.skeleton.parents.tolist()[1:], 1):
        world[:, joint] = world[:, parent] + rotation.rotate(turned[:, parent], places[:, joint])
    return world


def moving(motion: Motion, places: np.ndarray) -> np.ndarray:
    """``(joints,)`` metres by which joints leave the place that the skeleton gives them."""
    away = np.linalg.norm(places - motion.skeleton.offsets, axis=2).max(axis=0, initial=0.0)
    away[0] = 0.0
    return np.asarray(away)


def settled(motion: Motion, places: np.ndarray | None, way: Way) -> Settled:
    """Treat the positions of inner joints; ``auto`` drops them.

    drop: bones keep their length. bake: rotations are fitted to where joints really are, with bones of
    constant length. keep: as drop, and the places go on beside the motion.
    """
    if places is None:
        return Settled(motion)
    skeleton, height = motion.skeleton, max(motion.character.height, 1e-9)
    away = moving(motion, places)
    worst, count = int(away.argmax()), int((away > 1e-3 * height).sum()) or 1
    note = (
        f"{skeleton.names[worst]!r} moves by up to {away[worst]:.4g} m against its parent "
        f"({count} joint{'s do' if count > 1 else ' does'})"
    )
    real = positions(motion, places)
    if way == "bake":
        fitted = fit.fit(Positions(motion.character, real, motion.fps), motion)
        return Settled(fitted.motion, (f"{note}: baked into rotations, which leaves {fitted}",))
    off = np.linalg.norm(real - motion.positions, axis=2).max(axis=0)
    roles = [joint for joint, role in enumerate(motion.character.roles) if role] or list(range(len(off)))
    share = off[roles].max() / height
    note += f": bones keep their length, which moves joints by up to {off.max():.2g} m"
    if way == "keep":
        return Settled(motion, (f"{note}; their positions are kept for files of this body",), (), places)
    if way == "drop":
        return Settled(motion, (note,))
    if share <= _SMALL:
        return Settled(motion, (), (note,), None, note)
    note += f", joints of the body by {100 * share:.0f} % of its height"
    advice = "bake (rotations come as near as they can), keep (in files of this body) or drop"
    return Settled(motion, (), (f"{note}: say inner_positions={advice}",), None, note)
