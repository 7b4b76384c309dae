"""Takes put on training bodies of the puppets by a retargeting method, and checked."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from retarget_bench.api import Contacts, Context, Performed
from retarget_bench.errors import Unusable
from retarget_bench.files import cache_folder, digest, slug
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.contact import CONTACT_ROLES, planted
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.lazy_clips import parts
from retarget_bench.training.stored_pairs import Facts, StoredPairs, Tensors, stored, unit

METHOD = Spec("ik")
VERSION = "1"
"""Moves when what is kept of a take does."""
BODIES = 8
"""That each take is put on."""
WINDOW = 120
"""Frames of a pair, about."""
LEAST_RECALL = 0.8
"""Share of the frames in which a foot of the source rests, and the body's does too."""
LEAST_RESTING = 10
"""Frames of rest below which recall is not judged."""
FASTER, FAST = 1.5, np.radians(20.0)
"""No joint turns faster in a frame than so many times the source's fastest, or than this (radians)."""
LOWER = 0.03
"""How much deeper than the source's the lowest joint may go, heights."""


class Takes(Protocol):
    """The data set's part in it: whole takes, who performs them, and what identifies them."""

    def motion(self, take: str) -> Motion: ...
    def body(self, take: str) -> Character: ...
    def content_of(self, take: str) -> str: ...


@dataclass(frozen=True, eq=False)
class Onto:
    """Takes on bodies. takes: to be put on them. number: of drawn bodies to choose from."""

    data: Takes
    takes: Sequence[str]
    number: int

    @cached_property
    def identity(self) -> str:
        """The identity of bodies and method, for caches."""
        return f"on {self._puppets.content}, {METHOD} {bound.method_code(METHOD)}, {VERSION}"

    @cached_property
    def _puppets(self) -> Any:
        return bound.dataset(Spec("puppets", {"bodies": self.number})).built

    @cached_property
    def cast(self) -> Mapping[str, Character]:
        """All two-legged training bodies."""
        everybody = self._puppets.characters()
        names = [name for bodies in self._puppets.training().values() for name in bodies]
        return {name: everybody[name] for name in names if not everybody[name].four_legged}

    @cached_property
    def chosen(self) -> Mapping[str, Sequence[str]]:
        """Take -> the bodies that it is put on, any as likely as each other."""
        return {
            take: sorted(self.cast, key=lambda name: digest(f"{take} {name}", 16))[:BODIES]
            for take in self.takes
        }

    @cached_property
    def by_body(self) -> Mapping[str, Sequence[str]]:
        """Body -> takes."""
        takes: dict[str, list[str]] = {}
        for take, names in self.chosen.items():
            for name in names:
                takes.setdefault(name, []).append(take)
        return {name: takes[name] for name in self.cast if name in takes}

    def motion(self, take: str, name: str) -> Motion:
        """A whole take by a body. Raises Unusable where it fails a check."""
        stored = self._stored(take)
        faults = json.loads(stored.metadata()["faults"])
        if name in faults:
            raise Unusable(take, f"{name}: {faults[name]}")
        rotations, root = (stored.get_tensor(f"{name} {key}") for key in ("rotations", "root"))
        return self.cast[name].motion(unit(rotations), root, float(stored.metadata()["fps"]))

    def performance(self, take: str, frames: slice) -> _Window:
        return _Window(self, take, self._stored(take), frames)

    def _stored(self, take: str) -> Any:
        name = f"{take}-{digest(self.data.content_of(take))}"
        path = cache_folder() / "cmu" / slug(self.identity) / f"{slug(name)}.safetensors"
        return stored(Path(path), lambda: self._retargeted(take))

    def _retargeted(self, take: str) -> tuple[Tensors, Facts]:
        method, source = bound.method(METHOD).built, self.data.motion(take)
        labels = _planted(source)
        tensors = _tensors(source, labels)
        faults: dict[str, str] = {}
        for name in self.chosen[take]:
            body = self.cast[name]
            if why := method.supports(source.character, body):
                faults[name] = why
                continue
            motion = method.retarget(source, body, context=Context())
            assert isinstance(motion, Motion)
            if why := fault(source, motion):
                faults[name] = why
                continue
            own = {role: label & labels.get(role, label) for role, label in _planted(motion).items()}
            tensors |= _tensors(motion, own)
        return tensors, {"faults": json.dumps(faults), "fps": repr(source.fps)}


class Pairs(StoredPairs):
    """Windows of takes by their performer and by the bodies that they are put on."""

    def __init__(self, onto: Onto, lengths: Mapping[str, int]) -> None:
        """lengths: take -> frames."""
        self._onto = onto
        self._windows = [(take, each) for take, frames in lengths.items() for each in parts(frames, WINDOW)]
        super().__init__(len(self._windows), BODIES + 1)

    def performance(self, number: int) -> _Window:
        return self._onto.performance(*self._windows[number])


class _Window:
    """A part of a take; ``able`` has the performer first."""

    exact, kind = False, ""

    def __init__(self, onto: Onto, take: str, stored: Any, frames: slice) -> None:
        self._onto, self._stored, self._frames = onto, stored, frames
        self.clip = f"{take}@{frames.start}"
        faults = json.loads(stored.metadata()["faults"])
        self._performer = onto.data.body(take)
        names = [name for name in onto.chosen[take] if name not in faults]
        self.able: Sequence[str] = (self._performer.name, *names)

    def of(self, name: str) -> Performed:
        performer = self._performer
        body = performer if name == performer.name else self._onto.cast[name]
        rotations, root, labels = (
            self._stored.get_slice(f"{name} {key}")[self._frames]
            for key in ("rotations", "root", "planted")
        )
        motion = body.motion(unit(rotations), root, float(self._stored.metadata()["fps"]))
        return Performed(motion, Contacts(tuple(_roles(body)), labels))


def fault(source: Motion, answer: Motion) -> str:
    """The check that a retargeted motion fails, as a clause; "" where it fails none: foot contacts, speed
    of joints, depth below the floor."""
    source_contacts, answer_contacts = _planted(source), _planted(answer)
    roles = [role for role in source_contacts if role in answer_contacts]
    resting = sum(int(source_contacts[role].sum()) for role in roles)
    held = sum(int((source_contacts[role] & answer_contacts[role]).sum()) for role in roles)
    if resting >= LEAST_RESTING and held < LEAST_RECALL * resting:
        return f"feet lose contact (recall {held / resting:.2f})"
    fastest, allowed = _fastest(answer), max(FASTER * _fastest(source), FAST)
    if fastest > allowed:
        return f"a joint turns too fast ({np.degrees(fastest):.0f} degrees a frame)"
    shared = source.character.joint_of.keys() & answer.character.joint_of.keys()
    depth = _lowest(answer, shared) - _lowest(source, shared)
    if depth < -LOWER:
        return f"goes below the floor (by {-depth:.2f} heights)"
    return ""


def _fastest(motion: Motion) -> float:
    """Radians a frame, of joints with a role."""
    joints = sorted(motion.character.joint_of.values())
    turns = rotation.angle(motion.rotations[:-1, joints], motion.rotations[1:, joints])
    return float(turns.max(initial=0.0))


def _lowest(motion: Motion, roles: Iterable[str]) -> float:
    """Heights over the floor, of joints of these roles."""
    joints = [motion.character.joint_of[role] for role in roles]
    return float(motion.positions[:, joints, 1].min()) / motion.character.height


def _roles(body: Character) -> list[str]:
    return [role for role in CONTACT_ROLES if role in body.joint_of]


def _planted(motion: Motion) -> dict[str, np.ndarray]:
    """Contact role -> ``(frames,)`` bool, by speed."""
    body = motion.character
    roles = _roles(body)
    labels = planted(motion.positions[:, [body.joint_of[role] for role in roles]], body.height, motion.fps)
    return dict(zip(roles, labels.T, strict=True))


def _tensors(motion: Motion, labels: Mapping[str, np.ndarray]) -> Tensors:
    name = motion.character.name
    return {
        f"{name} rotations": motion.rotations.astype(np.float32),
        f"{name} root": motion.root.astype(np.float32),
        f"{name} planted": np.stack([labels[role] for role in _roles(motion.character)], axis=1),
    }
