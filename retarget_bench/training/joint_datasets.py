"""Joint data sets for training, written ``a[..]+b[..]``; no other command accepts them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path

from retarget_bench.api import SPLITS, Case, CaseInfo, Dataset, DatasetCard, TrainingClips
from retarget_bench.api.completing import complete
from retarget_bench.api.datasets import Cast
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks import RETARGET
from retarget_bench.files import free_name
from retarget_bench.motion.character import Character
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.clips import training_clips


# -------------------------------------------------------------------------------------------- as specs
def joint_spec(datasets: Sequence[Spec]) -> Spec:
    """One spec for all of them, in their order."""
    first, *others = [each for spec in datasets for each in split_spec(spec)]
    return Spec(first.name, first.parameters, tuple(others))


def split_spec(spec: Spec) -> tuple[Spec, ...]:
    """The data sets that a spec names."""
    return (spec.alone, *spec.posts)


def without_places(spec: Spec) -> Spec:
    """The spec without where files of the data sets lie."""
    return joint_spec([Spec(each.name, bound.dataset(each).parameters) for each in split_spec(spec)])


def canonical(spec: Spec) -> Spec:
    """The canonical spec, as ``registry.canonical`` gives it of one data set. Raises BenchError, also
    where two are the same."""
    specs = [registry.canonical("datasets", each) for each in split_spec(spec)]
    for number, each in enumerate(specs):
        for other in specs[:number]:
            if each == other:
                raise BenchError(f"{each} is given twice; name every data set once")
            if each.name == other.name and (place := _place(each)) and place == _place(other):
                raise BenchError(
                    f"{other} and {each} are of the same files; one could train on what the other tests"
                )
    return joint_spec(specs)


def dataset(spec: Spec) -> Dataset:
    """The data set, or several as one, built once per process."""
    return _several(spec) if spec.posts else bound.dataset(spec).built


@cache
def _several(spec: Spec) -> JointDataset:
    return JointDataset([bound.dataset(each).built for each in split_spec(spec)])


def tested(spec: Spec) -> Spec | None:
    """The first of the data sets that a spec names to have cases; None where none has."""
    for each in split_spec(spec):
        data = bound.dataset(each).built
        if any(data.cases(RETARGET, split) for split in data.card.splits):
            return each
    return None


def _place(spec: Spec) -> dict[str, str]:
    """Places of its files: location parameter -> absolute path, of those that are given."""
    locations = {name: spec.parameters.get(name) for name in bound.dataset(Spec(spec.name)).locations}
    return {name: str(Path(str(at)).expanduser().resolve()) for name, at in locations.items() if at}


# ---------------------------------------------------------------------------------------- as a data set
@dataclass(frozen=True, eq=False)
class Member:
    """One of the data sets. names: what it calls its characters -> what they are called here."""

    data: Dataset
    names: Mapping[str, str]


class JointDataset(Dataset):
    """Several data sets as one: training motion, validation, cases.

    Structures of one name are one. A character whose name an earlier data set has too is called
    ``name-2`` here, a case likewise; manifests keep the names that the data sets themselves give.
    """

    def __init__(self, datasets: Sequence[Dataset]) -> None:
        self._datasets = tuple(complete(each, Dataset) for each in datasets)
        cards = [data.card for data in self._datasets]
        splits = {name: meaning for card in cards for name, meaning in card.splits.items()}
        self.card = DatasetCard(
            name="+".join(card.name for card in cards),
            summary="; ".join(card.summary for card in cards),
            version="+".join(card.version for card in cards),
            licence="; ".join(card.licence for card in cards),
            obtain="; ".join(card.obtain for card in cards),
            splits={name: splits[name] for name in (*SPLITS, *splits) if name in splits},
        )

    @property
    def content(self) -> str:
        return " + ".join(data.content for data in self._datasets)

    @property
    def label(self) -> str:
        return " + ".join(data.label.strip() for data in self._datasets)

    @property
    def notes(self) -> Sequence[str]:
        return tuple(f"{data.label.strip()}: {note}" for data in self._datasets for note in data.notes)

    @cached_property
    def members(self) -> tuple[Member, ...]:
        used: set[str] = set()
        return tuple(Member(data, _renamed(_names(data), used)) for data in self._datasets)

    def characters(self) -> Mapping[str, Character]:
        return {
            member.names[name]: _called(body, member.names[name])
            for member in self.members
            for name, body in member.data.characters().items()
        }

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """Those of every data set, one data set after the other."""
        here = (info for info, _, _ in self._listed.values())
        return tuple(info for info in here if (info.task, info.split) == (task, split))

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case of none of them, and whatever its data set raises."""
        if info.id not in self._listed:
            raise BenchError(f"{self.label} has no case {info.id}")
        here, data, own = self._listed[info.id]
        return replace(data.load(own), info=here)

    # ------------------------------------------------------------------------------- to train on
    def training(self) -> Cast:
        """Structure -> character -> its clips. Raises NotSupported where a data set has none."""
        cast: dict[str, dict[str, TrainingClips]] = {}
        for member in self.members:
            for structure, characters in training_clips(member.data).items():
                cast.setdefault(structure, {}).update(
                    {member.names[name]: clips for name, clips in characters.items()}
                )
        return cast

    def validation(self) -> JointDataset | None:
        """The cases of those that have a validation part; None where none has."""
        parts = [part for data in self._datasets if (part := data.validation()) is not None]
        return JointDataset(parts) if parts else None

    @property
    def training_notes(self) -> Sequence[str]:
        """Sentences on what training leaves out, and on data sets without validation beside others."""
        notes = [f"{data.label.strip()}: {note}" for data in self._datasets for note in data.training_notes]
        unparted = [data.label.strip() for data in self._datasets if data.validation() is None]
        if 0 < len(unparted) < len(self._datasets):
            notes.append(f"no part of {' and of '.join(unparted)} validates: other data chose the weights")
        return tuple(notes)

    @cached_property
    def _listed(self) -> Mapping[str, tuple[CaseInfo, Dataset, CaseInfo]]:
        """Id here -> the case as it is known here, whose it is, and as it is known there."""
        cases: dict[str, tuple[CaseInfo, Dataset, CaseInfo]] = {}
        for member in self.members:
            data, names = member.data, member.names
            for own in (each for split in data.card.splits for each in data.cases(RETARGET, split)):
                source, target = names[own.source], names[own.target]
                here = replace(own, id=free_name(own.id, cases), source=source, target=target)
                cases[here.id] = here, data, own
        return cases


def _names(data: Dataset) -> list[str]:
    """Names of all characters that a data set tests and trains on."""
    moving = data.training()
    return sorted({*data.characters(), *(name for characters in moving.values() for name in characters)})


def _renamed(names: Sequence[str], used: set[str]) -> Mapping[str, str]:
    """Names -> names that are not in ``used`` yet; these are added to it."""
    renamed = {name: name for name in names if name not in used}
    used.update(names)
    for name in names:
        if name not in renamed:
            renamed[name] = free_name(name, used)
            used.add(renamed[name])
    return renamed


def _called(body: Character, name: str) -> Character:
    return body if body.name == name else replace(body, name=name)
