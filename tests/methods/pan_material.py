"""Small bodies on two legs and on four that dance, as PAN is trained on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import method_bodies
import numpy as np
import torch
from training_material import training_data

from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.training import PanTraining
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.config import TrainingConfig

WINDOW = 16


def without(character: Character, *words: str, structure: str) -> Character:
    """The body without the joints whose names begin so, as one of another structure."""
    old = character.skeleton
    kept = [n for n, name in enumerate(old.names) if not name.startswith(words)]
    parents = [kept.index(int(old.parents[n])) if old.parents[n] >= 0 else -1 for n in kept]
    names = tuple(old.names[n] for n in kept)
    skeleton = Skeleton(names, np.array(parents), old.offsets[kept])
    return Character.of(f"{character.name}_{structure}", skeleton, structure=structure)


def with_pelvis(character: Character) -> Character:
    """The body with a joint without a role below its hips, which the legs hang from."""
    old = character.skeleton
    below = np.array([0.01, -0.05, 0.02])
    names = (old.names[0], "Pelvis", *old.names[1:])
    legs = [name.endswith("UpLeg") for name in old.names[1:]]
    parents = [1 if leg else int(p) + (p > 0) for leg, p in zip(legs, old.parents[1:], strict=True)]
    offsets = old.offsets[1:] - np.where(np.array(legs)[:, None], below, 0.0)
    skeleton = Skeleton(
        names, np.array([-1, 0, *parents]), np.concatenate([old.offsets[:1], [below], offsets])
    )
    return Character.of(f"{character.name}_pelvis", skeleton, structure="pelvis")


def dog(name: str, scale: float = 1.0) -> Character:
    """Trunk and tail level, four straight legs, the nose to +Z."""
    rows: list[tuple[str, str, tuple[float, float, float]]] = [
        ("Hips", "", (0.0, 0.5, 0.0)),
        ("Spine", "Hips", (0.0, 0.0, 0.25)),
        ("Spine1", "Spine", (0.0, 0.0, 0.25)),
        ("Neck", "Spine1", (0.0, 0.1, 0.1)),
        ("Head", "Neck", (0.0, 0.12, 0.1)),
        ("Tail", "Hips", (0.0, 0.0, -0.15)),
        ("Tail1", "Tail", (0.0, 0.0, -0.15)),
    ]
    for side, out in (("Left", 0.1), ("Right", -0.1)):
        rows += [
            (f"{side}Shoulder", "Spine1", (out / 2, -0.05, 0.0)),
            (f"{side}Arm", f"{side}Shoulder", (out / 2, -0.05, 0.0)),
            (f"{side}ForeArm", f"{side}Arm", (0.0, -0.2, 0.0)),
            (f"{side}Hand", f"{side}ForeArm", (0.0, -0.2, 0.0)),
            (f"{side}UpLeg", "Hips", (out, -0.05, 0.0)),
            (f"{side}Leg", f"{side}UpLeg", (0.0, -0.22, 0.0)),
            (f"{side}Foot", f"{side}Leg", (0.0, -0.23, 0.0)),
        ]
    names = [row[0] for row in rows]
    parents = [names.index(row[1]) if row[1] else -1 for row in rows]
    offsets = scale * np.array([row[2] for row in rows])
    return Character.of(name, Skeleton(tuple(names), np.array(parents), offsets), structure="dog")


def _bodies() -> dict[str, Character]:
    plain = [method_bodies.body("one"), method_bodies.body("tall", scale=1.4)]
    short = [method_bodies.body("legs", spines=2, thigh=0.6, shin=0.5, arm=0.2)]
    short.append(method_bodies.body("stout", spines=2, hip=0.2))
    characters = [replace(each, structure="plain") for each in plain]
    characters += [replace(each, structure="short.spine") for each in short]
    lame = [
        without(each, "RightShoulder", "RightArm", "RightForeArm", "RightHand", structure="one_armed")
        for each in plain
    ]
    return {each.name: each for each in [*characters, *lame, dog("rex"), dog("pup", 0.5)]}


BODIES: Mapping[str, Character] = _bodies()
TWO = ("one", "tall", "legs", "stout")
THREE = (*TWO, "one_one_armed", "tall_one_armed")
LEGS = ("one", "tall", "rex", "pup")


def training_module(
    names: Sequence[str] = TWO,
    lengths: Sequence[int] = (30, 40),
    window: int = WINDOW,
    seed: int = 0,
    small: bool = False,
    **parameters: Any,
) -> PanTraining:
    """small: networks that are narrower than a parameter makes them."""
    method = Pan(**parameters)
    if small:
        thin = replace(method.settings.design, embedding=(32,), feedforward=32, judging=16)
        method.settings = replace(method.settings, design=thin)
    torch.manual_seed(seed)
    cast = {name: BODIES[name] for name in names}
    return method.training_module(
        training_data(method, cast, lengths), TrainingConfig(steps=1, batch=4, window=window, rate=1e-3)
    )


@cache
def trained(names: Sequence[str] = TWO, **parameters: Any) -> Pan:
    """A method with weights that are drawn, not learnt: answers that differ from frame to frame."""
    method: Any = training_module(names, **parameters).method()
    return method  # type: ignore[no-any-return]
