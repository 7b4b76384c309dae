"""Hands in the rest of the body, where the character has a mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.penetration import inside, inside_at_rest, limbs
from retarget_bench.motion.penetration.limbs import below
from retarget_bench.motion.roles import SIDES
from retarget_bench.verification.verdict.coarse import coarse_body
from retarget_bench.verification.verdict.defects import Defect, stretches
from retarget_bench.verification.verdict.pair import Pair

LOOKS = 6.0
"""Times a second that hands are looked at."""
MOST = 400
"""Looks at most: of longer motions there are fewer a second."""
SHARE = 0.3
"""Share of a hand's surface that may be inside."""
_BLOCK = 64


def hands(pair: Pair) -> Iterator[Defect]:
    """Stretches in which more of a hand is inside than ``SHARE``, and than of the source's own."""
    result = pair.result
    if not isinstance(result, Motion) or not _has_surface(result):
        return
    step = max(1, round(result.fps / LOOKS), -(-result.frames // MOST))
    looks = np.arange(0, result.frames, step)
    found = shares(result, looks)
    own = isinstance(pair.source, Motion) and _has_surface(pair.source)
    theirs = shares(pair.source, looks) if own else {}  # type: ignore[arg-type]
    for side, share in found.items():
        source = theirs.get(side)
        passing = SHARE + (0.0 if source is None else source)
        for part in stretches(np.repeat(share > passing, step)[: result.frames], result.fps):
            looked = slice(part.start // step, -(-part.stop // step))
            worst = looked.start + int(np.argmax(share[looked]))
            amount = 100 * float(share[worst])
            before = None if source is None else 100 * float(source[worst])
            yield Defect(
                "inside",
                f"{side} hand",
                part.start,
                part.stop - 1,
                int(looks[worst]),
                amount,
                before,
                "%",
                float(share[worst] / np.broadcast_to(passing, share.shape)[worst]),
                f"{side} hand is in the body ({amount:.0f} % of it"
                + (")" if before is None else f"; source {before:.0f} %)"),
            )


def shares(motion: Motion, frames: np.ndarray, body: Character | None = None) -> dict[str, np.ndarray]:
    """Side -> ``(frames,)`` share of the hand's surface that is inside the body and was not in the
    reference pose, at some frames of a motion with a mesh. body: the character with the mesh to look at, a
    coarse one by default."""
    body = body or coarse_body(motion.character)
    motion = replace(motion, character=body)
    assert body.mesh is not None
    found: dict[str, list[np.ndarray]] = {}
    for first in range(0, len(frames), _BLOCK):
        vertices = body.mesh.skinned(motion.at(frames[first : first + _BLOCK]))
        tested = zip(limbs(body), inside(body, vertices), inside_at_rest(body), strict=True)
        for limb, now, rest in tested:
            side, _, part = limb.name.partition("_")
            if part != "arm" or (hand := body.joint_of.get(f"{side}_hand")) is None:
                continue
            weights = body.mesh.weights[limb.tested][:, below(body.skeleton, hand)].sum(axis=1)
            areas = np.where(weights > 0.5, limb.areas, 0.0)
            if areas.sum() > 0:
                found.setdefault(side, []).append((now & ~rest) @ areas / areas.sum())
    return {side: np.concatenate(found[side]) for side in SIDES if side in found}


def _has_surface(motion: Prediction) -> bool:
    mesh = motion.character.mesh
    return mesh is not None and len(mesh.faces) > 0
