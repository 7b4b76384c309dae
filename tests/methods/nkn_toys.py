"""Small casts, material and learners for the tests of NKN."""

from __future__ import annotations

from typing import Any

import torch
from method_bodies import body, dance
from training_material import single_precision

from retarget_bench.motion.character import Character
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData

CAST = {
    "one": body("one"),
    "long": body("long", thigh=0.55, shin=0.5, arm=0.34),
    "small": body("small", scale=0.6),
}


def structured(character: Character, name: str, structure: str) -> Character:
    """The same body under another name and structure."""
    return Character.of(name, character.skeleton, structure=structure, roles=character.roles)


STRUCTURES = {
    name: structured(character, name, structure)
    for name, character, structure in (
        ("one", body(), "three"),
        ("long", body(thigh=0.6, arm=0.35), "three"),
        ("bendy", body(spines=5), "five.spine"),
        ("small", body(spines=5, scale=0.6), "five.spine"),
    )
}
"""Two bodies of either of two structures."""


def training_data(method: Any, cast: dict[str, Character] | None = None, frames: int = 24) -> TrainingData:
    """One dance of every body; those of the n-th are n frames shorter."""
    cast = cast or CAST
    clips = {}
    for number, (name, character) in enumerate(cast.items()):
        motion = dance(character, frames - number, seed=number)
        clips[name] = [ClipArrays(name, "dance", single_precision(method.prepare(motion)))]
    return TrainingData(dict(cast), clips)


def training_module(
    method: Any, window: int = 16, seed: int = 0, cast: dict[str, Character] | None = None
) -> Any:
    torch.manual_seed(seed)
    return method.training_module(
        training_data(method, cast), TrainingConfig(steps=1, batch=4, window=window, rate=1e-3)
    )
