"""The corpus of size ``tiny`` as it was published, read from files that come with the package.

``generator/corpus/freezing.py`` writes them. Nothing of the generator is imported here: it may change, or
be absent.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import SPLITS, Case, CaseInfo, Contacts, Touch
from retarget_bench.motion.character import Character
from retarget_bench.motion.ground import FLAT, Ground
from retarget_bench.motion.measures import measure
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import EndSite, Skeleton

from .archives import Archive, read
from .cones import Cones
from .contract import SECOND, USUAL, Cast, Clips, Labels, Manner, Part, Training, absent, in_double

FOLDER = Path(__file__).with_name("tiny")
PREFIX = "puppets/"
"""Of the ids of cases."""
_HELD = 64
"""Clips whose arrays are kept in memory."""


@dataclass(frozen=True)
class Listed:
    name: str
    frames: int


@cache
def _index() -> Mapping[str, Any]:
    facts: Mapping[str, Any] = json.loads(read(FOLDER, "index.json"))
    return facts


@cache
def _archive(name: str) -> Archive:
    return Archive(read(FOLDER, f"{name}.npz"))


# ------------------------------------------------------------------------------------------ bodies
def _structure(name: str) -> Mapping[str, Any]:
    """Facts about the structure of a body."""
    facts: Mapping[str, Any] = _index()["structures"][_index()["bodies"][name]["structure"]]
    return facts


def _character(name: str) -> Character:
    structure, bodies = _structure(name), _archive("bodies")
    sites = zip(structure["ends"], bodies[f"{name} ends"].tolist(), strict=True)
    skeleton = Skeleton(
        tuple(structure["joints"]),
        np.array(structure["parents"]),
        bodies[f"{name} offsets"],
        tuple(EndSite(joint, tuple(place)) for joint, place in sites),
    )
    roles, pose = tuple(structure["roles"]), bodies[f"{name} pose"]
    return Character(
        name,
        skeleton,
        _index()["bodies"][name]["structure"],
        roles,
        pose,
        measure(skeleton, roles, pose),
        partial(_skin, name, pose),
    )


def _skin(name: str, pose: np.ndarray) -> Mesh:
    skins = _archive("skins")
    start, line, radii, follows, spread = (
        skins[f"{name} {part}"] for part in ("start", "line", "radii", "follows", "spread")
    )
    vertices, cones = skins[f"{name} vertices"], Cones(start, line, radii, follows, float(spread))
    return Mesh(vertices, skins[f"{name} faces"].astype(np.int64), cones.weights(vertices), pose)


@cache
def _cast() -> Cast:
    return Cast(_index()["bodies"], _character)


# ----------------------------------------------------------------------------------------- motions
Column = tuple[str, Manner]
"""A body and its manner: one motion of a clip."""


@dataclass(frozen=True, eq=False)
class Take:
    """All motions of a clip, one after the other in each array.

    rotations: ``(joints, 4, frames)`` local, in single precision. roots: ``(motions, 3, frames)`` metres.
    contacts:  ``(labelled joints, 2, frames)`` bool, planted and pivoting, of the usual motions alone:
               second answers have the same.
    """

    columns: Sequence[Column]
    rotations: np.ndarray
    roots: np.ndarray
    contacts: np.ndarray

    def motion(self, name: str, manner: Manner) -> Motion:
        place = self.columns.index((name, manner))
        before = sum(_joints(body) for body, _ in self.columns[:place])
        local = np.moveaxis(self.rotations[before : before + _joints(name)], -1, 0)
        rotations = in_double(np.ascontiguousarray(local))
        return _cast()[name].motion(rotations, self.roots[place].T, _index()["fps"])

    def labels(self, name: str) -> Contacts:
        bodies = [body for body, manner in self.columns if manner == USUAL]
        before = sum(len(_structure(body)["contacts"]) for body in bodies[: bodies.index(name)])
        roles = tuple(_structure(name)["contacts"])
        planted, pivoting = np.moveaxis(self.contacts[before : before + len(roles)], 0, -1)
        return Contacts(roles, np.ascontiguousarray(planted), np.ascontiguousarray(pivoting))


def _joints(name: str) -> int:
    return len(_structure(name)["joints"])


def columns(performers: Mapping[str, bool]) -> tuple[Column, ...]:
    """The motions of a clip in the order of its arrays: all bodies', then second answers of targets.

    performers: body -> whether it is the target of a case.
    """
    targets = [name for name, target in performers.items() if target]
    return (*((name, USUAL) for name in performers), *((name, SECOND) for name in targets))


@lru_cache(_HELD)
def _take(archive: str, clip: str, held: tuple[Column, ...]) -> Take:
    arrays = _archive(archive)
    return Take(held, *(arrays[f"{clip} {name}"] for name in ("rotations", "roots", "contacts")))


# ------------------------------------------------------------------------------------------ corpus
class Frozen:
    """One part of the corpus (``contract.py``)."""

    variant = ""

    def __init__(self, part: Part) -> None:
        self.part = part

    @cached_property
    def _facts(self) -> Mapping[str, Any]:
        facts: Mapping[str, Any] = _index()[self.part]
        return facts

    @property
    def bodies(self) -> int:
        return len(_index()["bodies"])

    @property
    def clips(self) -> Mapping[str, str]:
        return {name: clip["kind"] for name, clip in self._facts["clips"].items()}

    @property
    def cast(self) -> Mapping[str, Character]:
        return _cast()

    def cases(self, split: str) -> Sequence[CaseInfo]:
        return tuple(self._info(*case, split=split) for case in self._listed(split))

    def between_legs(self) -> Sequence[CaseInfo]:
        return tuple(self._unpaired(*case) for case in self._listed("legs"))

    def real(self, structure: str) -> Sequence[CaseInfo]:
        return [
            self._unpaired(clip, name, name)
            for clip, performers in self._performed.items()
            if self._facts["clips"][clip]["flat"]
            for name in performers
            if _index()["bodies"][name]["structure"] == structure
        ]

    def _listed(self, name: str) -> Iterator[tuple[str, str, str]]:
        """Clip, source and target of a list of cases."""
        for case in self._facts["cases"][name]:
            pair, _, clip = case.partition("/")
            source, _, target = pair.partition(">")
            yield clip, source, target

    def _info(self, clip: str, source: str, target: str, *, split: str, kind: str = "") -> CaseInfo:
        facts = self._facts["clips"][clip]
        return CaseInfo(
            id=f"{PREFIX}{source}>{target}/{clip}",
            task="retarget",
            split=split,
            source=source,
            target=target,
            clip=clip,
            kind=kind or facts["kind"],
            frames=facts["frames"],
        )

    def _unpaired(self, clip: str, source: str, target: str) -> CaseInfo:
        """A case that is known by its main action, as those between legs and real motion are."""
        split = "self" if source == target else "cross"
        return self._info(clip, source, target, split=split, kind=self._facts["clips"][clip]["action"])

    @cached_property
    def _performed(self) -> Mapping[str, Mapping[str, bool]]:
        """Clip -> the bodies that perform it in any case, and whether they are targets."""
        performed: dict[str, dict[str, bool]] = {}
        for clip, source, target in (case for split in SPLITS for case in self._listed(split)):
            bodies = performed.setdefault(clip, {})
            bodies.setdefault(source, False)
            bodies[target] = True
        return performed

    def performers(self) -> Mapping[str, tuple[str, ...]]:
        return {clip: tuple(bodies) for clip, bodies in self._performed.items()}

    def _take(self, clip: str) -> Take:
        return _take(self.part, clip, columns(self._performed[clip]))

    def motion(self, clip: str, name: str, manner: Manner) -> Motion | None:
        held = self._performed.get(clip, {})
        if name not in held or (manner == SECOND and not held[name]):
            return None
        return self._take(clip).motion(name, manner)

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this corpus.

        Real motion of bodies that are the target of no case is without a second answer.
        """
        take, target = self._take_of(info), _cast()[info.target]
        source = take.motion(info.source, USUAL)
        if info.target not in self._performed[info.clip]:
            return Case(info, source, target)
        return Case(
            info=info,
            source=source,
            target=target,
            reference=take.motion(info.target, USUAL),
            contacts=take.labels(info.target),
            ground=self._ground(info.clip, info.target),
            alternative=self.motion(info.clip, info.target, SECOND),
            touches=self._touches(info.clip, info.target),
        )

    def _take_of(self, info: CaseInfo) -> Take:
        bodies, performers = _index()["bodies"], self._performed.get(info.clip, {})
        if info.source in performers and info.target in bodies:
            legs = bodies[info.source]["family"] != bodies[info.target]["family"]
            if legs or info.target in performers:
                return self._take(info.clip)
        raise absent(info, "tiny", self.part)

    def _ground(self, clip: str, name: str) -> Ground:
        if self._facts["clips"][clip]["flat"]:
            return FLAT
        arrays = _archive(self.part)
        x, z, spacing = arrays[f"{clip} {name} grid"].tolist()
        return Ground(heights=arrays[f"{clip} {name} heights"], origin=(x, z), spacing=spacing)

    def _touched(self, clip: str) -> Mapping[str, np.ndarray]:
        """Hand and place -> the frames in which the hand rests there."""
        names = self._facts["clips"][clip]["touches"]
        return dict(zip(names, _archive(self.part)[f"{clip} touches"], strict=True)) if names else {}

    def _touches(self, clip: str, name: str) -> tuple[Touch, ...]:
        """Those on places whose joints the body has."""
        touches = _structure(name)["touches"]
        points = dict(zip(touches, _archive("bodies")[f"{name} touches"], strict=True))
        return tuple(
            Touch(touches[hand][0], points[hand][0], touches[hand][1], points[hand][1], rests)
            for hand, rests in self._touched(clip).items()
            if hand in touches
        )

    def labels(self, info: CaseInfo) -> Labels:
        facts, take = self._facts["clips"][info.clip], self._take_of(info)
        kinds = [np.full(frames, kind) for kind, frames in facts["stretches"]]
        return Labels(
            np.concatenate(kinds),
            _archive(self.part)[f"{info.clip} phases"],
            take.labels(info.target),
            self._touched(info.clip),
        )

    def unseen(self, info: CaseInfo) -> frozenset[str]:
        bodies, kind = _index()["bodies"], self._facts["clips"][info.clip]["kind"]
        marks = {
            "source": bodies[info.source]["held_out"],
            "target": bodies[info.target]["held_out"],
            "kind": kind in _index()["held_out"],
        }
        return frozenset(name for name, new in marks.items() if new)

    def exclusions(self) -> Mapping[str, Mapping[str, float]]:
        exclusions: Mapping[str, Mapping[str, float]] = self._facts["exclusions"]
        return exclusions

    def training(self) -> Training:
        return {
            structure: {
                name: Clips(name, [Listed(clip, frames) for clip, frames in listed.items()], _trained)
                for name, listed in cast.items()
            }
            for structure, cast in _index()["training"].items()
        }

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        manifest: Mapping[str, Sequence[str]] = _index()["manifest"]
        return manifest


def _trained(clip: Listed, name: str) -> Motion:
    return _take("training", clip.name, columns({name: False})).motion(name, USUAL)
