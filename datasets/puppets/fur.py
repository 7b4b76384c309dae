"""Flesh of dogs: the cones of ``flesh.py`` around bones on four legs."""

from __future__ import annotations

import numpy as np

from .bodies import Body
from .flesh import MELT, Cone, joints_at, shares
from .score import SIDES

_SLICES = 15
_ALONG = (0.0, 0.5, 0.85, 1.0)
_RADIUS, _TOP, _BOTTOM = (2.3, 2.1, 2.7, 2.0), (0.8, 0.6, 1.3, 1.0), (1.9, 2.6, 4.6, 2.2)
"""Of the trunk from the hips to the base of the neck: radius, and how far its middle hangs below the back
on top and at the belly, girths."""


def cones(body: Body) -> list[Cone]:
    """The cones of a dog."""
    at = joints_at(body)
    found = [*_trunk(body, at), *_head(body, at)]
    for side in SIDES:
        found += [*_fore(body, at, side), *_hind(body, at, side)]
    return found


def _trunk(body: Body, at: dict[str, np.ndarray]) -> list[Cone]:
    girth, levels = body.proportions.girth, (("hips", 0.0), *body.structure.levels)
    # the base of the neck lies below the withers, which the back goes up to
    withers = at["neck"] + np.array([0.0, body.proportions.shoulder_drop + 0.4 * girth, 0.0])
    found = []
    for along in np.linspace(-0.04, 1.0, _SLICES):
        middle = at["hips"] + along * (withers - at["hips"])
        radius, top, bottom = (
            girth * float(np.interp(along, _ALONG, row)) for row in (_RADIUS, _TOP, _BOTTOM)
        )
        back, belly = (middle - np.array([0.0, down, 0.0]) for down in (top, bottom))
        found.append(Cone(back, belly, (radius, 0.9 * radius), shares(levels, float(along))))
    return found


def _head(body: Body, at: dict[str, np.ndarray]) -> list[Cone]:
    girth, size, nose = body.proportions.girth, body.proportions.head, body.tips["head"]
    skull, tail = at["head"] + 0.2 * nose, at["tail_2"] + body.tips["tail_2"]
    head = (("head", 1.0),)
    return [
        Cone(
            at["neck"] - np.array([0.0, 0.5 * girth, 0.0]),
            at["head"],
            (1.9 * girth, 1.3 * girth),
            (("neck", 1.0),),
        ),
        Cone(skull, skull, (0.27 * size, 0.27 * size), head),
        Cone(skull, at["head"] + 0.87 * nose, (0.19 * size, 0.12 * size), head),
        Cone(at["tail_1"], at["tail_2"], (0.5 * girth, 0.42 * girth), (("tail_1", 1.0),)),
        Cone(at["tail_2"], tail, (0.42 * girth, 0.3 * girth), (("tail_2", 1.0),)),
    ]


def _fore(body: Body, at: dict[str, np.ndarray], side: str) -> list[Cone]:
    blade, shoulder, elbow, wrist = (
        at[f"{side}_{part}"] for part in ("shoulder", "arm", "forearm", "hand")
    )
    return [
        _cone(body, blade, shoulder, (0.9, 1.2), f"{side}_shoulder"),
        _cone(body, shoulder, elbow, (1.25, 0.85), f"{side}_arm"),
        _cone(body, elbow, wrist, (0.8, 0.48), f"{side}_forearm"),
        *_paw(body, wrist, f"{side}_hand"),
    ]


def _hind(body: Body, at: dict[str, np.ndarray], side: str) -> list[Cone]:
    hip, knee, hock = (at[f"{side}_{part}"] for part in ("up_leg", "leg", "foot"))
    return [
        _cone(body, hip, knee, (1.9, 1.0), f"{side}_up_leg"),
        _cone(body, knee, hock, (0.95, 0.45), f"{side}_leg"),
        *_paw(body, hock, f"{side}_foot"),
    ]


def _paw(body: Body, joint: np.ndarray, part: str) -> list[Cone]:
    """From the last joint down, and forward along the floor."""
    high = (0.45 + 0.5 * MELT) * body.proportions.girth
    tip = joint + body.tips[part]
    ground = tip + np.array([0.0, high, -0.3 * body.proportions.ball])
    toes = tip + np.array([0.0, high, 0.6 * body.proportions.ball])
    return [_cone(body, joint, ground, (0.42, 0.45), part), _cone(body, ground, toes, (0.45, 0.42), part)]


def _cone(body: Body, start: np.ndarray, end: np.ndarray, radii: tuple[float, float], part: str) -> Cone:
    """radii: girths."""
    girth = body.proportions.girth
    return Cone(start, end, (radii[0] * girth, radii[1] * girth), ((part, 1.0),))
