"""The checks that a data set must pass."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from retarget_bench.api import SPLITS, Case, CaseInfo, Dataset
from retarget_bench.api.datasets import usual_split
from retarget_bench.files import slug
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import registry
from retarget_bench.verification.contract.common import Problems, Trial, demand

LOADED = 3
"""Cases of every split that are loaded and looked into."""


class DatasetTrial(Trial[Dataset]):
    """Checks of a data set on its first cases."""

    kind = "datasets"

    @property
    def listed(self) -> list[CaseInfo]:
        return _listed(self.plugin)

    @property
    def loaded(self) -> Iterator[Case]:
        for split in self.plugin.card.splits:
            for info in self.plugin.cases("retarget", split)[:LOADED]:
                yield self.plugin.load(info)

    @demand("its card says what it is, its licence and how to get it")
    def card(self) -> Problems:
        card = self.plugin.card
        texts = ("summary", "version", "licence", "obtain")
        if empty := [name for name in texts if not getattr(card, name).strip()]:
            yield f"no {', '.join(empty)}"
        if not isinstance(card.splits, Mapping):
            yield "splits is no mapping of names to what the cases of each have in common"
        if strange := [name for name in card.splits if name != slug(name)]:
            yield f"split {strange[0]!r} is no name of a folder"
        yield from self.card_fault(card)

    @demand("label, content and notes are text")
    def texts(self) -> Problems:
        for name in ("label", "content"):
            if not (isinstance(value := getattr(self.plugin, name), str) and value):
                yield f"{name} is {value!r}"
        yield from (f"a note is {note!r}" for note in self.plugin.notes if not isinstance(note, str))

    @demand("there is at least one case")
    def some(self) -> Problems:
        if not self.listed:
            yield "no case in any split"

    @demand("case ids are unique and say dataset/source>target/clip")
    def ids(self) -> Problems:
        ids = [info.id for info in self.listed]
        if len(set(ids)) != len(ids):
            yield f"{next(i for i in ids if ids.count(i) > 1)} is there twice"
        for info in self.listed:
            if info.id.split("/")[1:2] != [info.pair] or not info.clip:
                yield f"{info.id} of {info.pair}, clip {info.clip!r}"

    @demand("built again, it lists the same cases and the same content")
    def stable(self) -> Problems:
        again: Dataset = registry.create("datasets", self.spec)
        if again.content != self.plugin.content:
            yield f"content was {self.plugin.content!r}, then {again.content!r}"
        if _listed(again) != self.listed:
            yield "the lists of cases differ"

    @demand("splits follow characters and their structures")
    def splits(self) -> Problems:
        for case in self.loaded:
            info, source, target = case.info, case.source.character, case.target
            if (source.name, target.name) != (info.source, info.target):
                yield f"{info.id} holds {source.name}>{target.name}"
            alike = source.structure == target.structure
            split = usual_split(source.name == target.name, alike)
            if info.split in SPLITS and split != info.split:
                yield f"{info.id} is listed as {info.split} but is {split}"

    @demand("real motion, where it is offered, is of the structure asked for")
    def real(self) -> Problems:
        data = self.plugin
        if data.real is None:
            return
        for structure in {body.structure for body in self.plugin.characters().values()}:
            infos = data.real("retarget", structure)
            if len({(info.clip, info.target) for info in infos}) != len(infos):
                yield f"a clip of a body of {structure} is offered twice"
            for info in infos[:LOADED]:
                case = self.plugin.load(info)
                if case.reference is None:
                    yield f"{info.id} is offered as real motion and has no reference"
                if case.target.structure != structure:
                    yield f"{info.id} is offered for {structure} and is of {case.target.structure}"

    @demand("loaded cases fit together: frames, rates, shapes")
    def shapes(self) -> Problems:
        for case in self.loaded:
            yield from _misfits(case)

    @demand("loaded cases are finite and rotations are unit")
    def finite(self) -> Problems:
        for case in self.loaded:
            for name in ("source", "reference", "alternative"):
                motion = getattr(case, name)
                if motion is not None and not np.isfinite(motion.positions).all():
                    yield f"{case.info.id}: a position of the {name} is not finite"
                if not isinstance(motion, Motion):
                    continue
                if np.abs(np.linalg.norm(motion.rotations, axis=-1) - 1).max(initial=0.0) > 1e-6:
                    yield f"{case.info.id}: a rotation of the {name} is not a unit quaternion"

    @demand("a case loaded twice is the same")
    def repeatable(self) -> Problems:
        for case in self.loaded:
            again = self.plugin.load(case.info)
            if not np.array_equal(case.source.positions, again.source.positions):
                yield f"{case.info.id}: the sources differ"


def _listed(data: Dataset) -> list[CaseInfo]:
    return [info for split in data.card.splits for info in data.cases("retarget", split)]


def _misfits(case: Case) -> Problems:
    """The inconsistencies in a loaded case."""
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
        shape = (frames, len(contacts.roles))
        facts += [
            (contacts.planted.shape == shape, f"contacts {contacts.planted.shape}, not {shape}"),
            (contacts.planted.dtype == bool, f"contacts of type {contacts.planted.dtype}, not bool"),
            (
                contacts.pivoting is None or contacts.pivoting.shape == shape,
                f"pivoting contacts of another shape than {shape}",
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
    yield from (f"{case.info.id}: {text}" for fits, text in facts if not fits)
