"""The checks that a data set must pass."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from retarget_bench.api import SPLITS, Case, CaseInfo, Dataset
from retarget_bench.api.offers import offers_real
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.contract.common import Check, Checks
from retarget_bench.verification.contract.methods import undescribed

LOADED = 3
"""Cases of every split that are loaded and looked into."""


def check_dataset(spec: Spec) -> Iterator[Check]:
    """Every check of a data set; raises BenchError if it cannot be built."""
    trial = _Trial(spec)
    return iter(
        Checks(
            {
                "its card says what it is, its licence and how to get it": trial.card,
                "label, content and notes are text": trial.texts,
                "there is at least one case": trial.some,
                "case ids are unique and say dataset/source>target/clip": trial.ids,
                "built again, it lists the same cases and the same content": trial.stable,
                "splits follow characters and their structures": trial.splits,
                "loaded cases fit together: frames, rates, shapes": trial.shapes,
                "loaded cases are finite and rotations are unit": trial.finite,
                "a case loaded twice is the same": trial.repeatable,
                "real motion, where it is offered, is of the structure asked for": trial.real,
            }
        )
    )


class _Trial:
    """A data set and the cases that are looked into."""

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self.data: Dataset = registry.create("datasets", spec)

    @property
    def listed(self) -> list[CaseInfo]:
        return _listed(self.data)

    @property
    def loaded(self) -> Iterator[Case]:
        for split in self.data.card.splits:
            for info in self.data.cases("retarget", split)[:LOADED]:
                yield self.data.load(info)

    def card(self) -> str | None:
        card = self.data.card
        if card.name != self.spec.name:
            return f"card.name is {card.name!r}, but the plug-in is called {self.spec.name!r}"
        texts = ("summary", "version", "licence", "obtain")
        if empty := [name for name in texts if not getattr(card, name).strip()]:
            return f"no {', '.join(empty)}"
        if unknown := set(card.splits) - set(SPLITS):
            return f"splits {sorted(unknown)}; known are {', '.join(SPLITS)}"
        return undescribed("datasets", self.spec, card.parameters)

    def texts(self) -> str | None:
        for name in ("label", "content"):
            if not (isinstance(value := getattr(self.data, name), str) and value):
                return f"{name} is {value!r}"
        bad = next((note for note in self.data.notes if not isinstance(note, str)), None)
        return f"a note is {bad!r}" if bad is not None else None

    def some(self) -> str | None:
        return None if self.listed else "no case in any split"

    def ids(self) -> str | None:
        ids = [info.id for info in self.listed]
        if len(set(ids)) != len(ids):
            return f"{next(i for i in ids if ids.count(i) > 1)} is there twice"
        for info in self.listed:
            if info.id.split("/")[1:2] != [info.pair] or not info.clip:
                return f"{info.id} of {info.pair}, clip {info.clip!r}"
        return None

    def stable(self) -> str | None:
        again: Dataset = registry.create("datasets", self.spec)
        if again.content != self.data.content:
            return f"content was {self.data.content!r}, then {again.content!r}"
        return None if _listed(again) == self.listed else "the lists of cases differ"

    def splits(self) -> str | None:
        for case in self.loaded:
            info, source, target = case.info, case.source.character, case.target
            if (source.name, target.name) != (info.source, info.target):
                return f"{info.id} holds {source.name}>{target.name}"
            alike = source.structure == target.structure
            split = "self" if source.name == target.name else "intra" if alike else "cross"
            if split != info.split:
                return f"{info.id} is listed as {info.split} but is {split}"
        return None

    def real(self) -> str | None:
        data: object = self.data
        if not offers_real(data):
            return None
        for structure in {body.structure for body in self.data.characters().values()}:
            infos = data.real("retarget", structure)
            if len({(info.clip, info.target) for info in infos}) != len(infos):
                return f"a clip of a body of {structure} is offered twice"
            for info in infos[:LOADED]:
                case = self.data.load(info)
                if case.reference is None:
                    return f"{info.id} is offered as real motion and has no reference"
                if case.target.structure != structure:
                    return f"{info.id} is offered for {structure} and is of {case.target.structure}"
        return None

    def shapes(self) -> str | None:
        return next((problem for case in self.loaded if (problem := _misfit(case))), None)

    def finite(self) -> str | None:
        for case in self.loaded:
            for name in ("source", "reference", "alternative"):
                motion = getattr(case, name)
                if motion is not None and not np.isfinite(motion.positions).all():
                    return f"{case.info.id}: a position of the {name} is not finite"
                if isinstance(motion, Motion) and _off_unit(motion.rotations) > 1e-6:
                    return f"{case.info.id}: a rotation of the {name} is not a unit quaternion"
        return None

    def repeatable(self) -> str | None:
        for case in self.loaded:
            again = self.data.load(case.info)
            if not np.array_equal(case.source.positions, again.source.positions):
                return f"{case.info.id}: the sources differ"
        return None


def _listed(data: Dataset) -> list[CaseInfo]:
    return [info for split in data.card.splits for info in data.cases("retarget", split)]


def _misfit(case: Case) -> str | None:
    """What does not fit together in a loaded case."""
    frames, contacts = case.source.frames, case.contacts
    facts: list[tuple[bool, Any]] = [
        (frames > 0, "no frames"),
        (case.info.frames in (0, frames), f"{case.info.frames} frames listed, {frames} loaded"),
    ]
    for name, answer in (("reference", case.reference), ("alternative", case.alternative)):
        if answer is not None:
            facts += [
                (answer.frames == frames, f"{name} of {answer.frames} frames, source of {frames}"),
                (answer.fps == case.source.fps, f"{name} at {answer.fps}, source at {case.source.fps}"),
                (answer.skeleton.same_as(case.target.skeleton), f"the {name} has another skeleton"),
            ]
    if contacts is not None:
        unknown = set(contacts.roles) - set(case.target.joint_of)
        wanted = (frames, len(contacts.roles))
        facts += [
            (contacts.planted.shape == wanted, f"contacts {contacts.planted.shape}, not {wanted}"),
            (contacts.planted.dtype == bool, f"contacts of type {contacts.planted.dtype}, not bool"),
            (
                contacts.pivoting is None or contacts.pivoting.shape == wanted,
                "contacts that pivot have another shape than those that are planted",
            ),
            (not unknown, f"contacts of {', '.join(sorted(unknown))}, which the target does not have"),
        ]
    for touch in case.touches or ():
        unknown = {touch.end, touch.bearing} - set(case.target.joint_of)
        shapes = (np.shape(touch.point), np.shape(touch.place), touch.rests.shape)
        facts += [
            (shapes == ((3,), (3,), (frames,)), f"a touch of shapes {shapes}, not (3,), (3,), ({frames},)"),
            (touch.rests.dtype == bool, f"a touch that rests by {touch.rests.dtype}, not bool"),
            (not unknown, f"a touch of {', '.join(sorted(unknown))}, which the target does not have"),
        ]
    return next((f"{case.info.id}: {text}" for fits, text in facts if not fits), None)


def _off_unit(rotations: np.ndarray) -> float:
    return float(np.abs(np.linalg.norm(rotations, axis=-1) - 1).max(initial=0.0))
