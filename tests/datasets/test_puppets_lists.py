"""The puppets' lists: sizes, parts, splits, casting, training, and who is left out of what."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

from retarget_bench.api import SPLITS, CaseInfo
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.generator.corpus.clips import clips, shortfalls, unable
from retarget_bench.datasets.puppets.generator.corpus.families import (
    HELD_OUT_KINDS,
    HELD_OUT_STRUCTURES,
    VALIDATION_BODIES,
    bodies_of,
    families,
    kinds_of,
)
from retarget_bench.datasets.puppets.generator.solver.reach import TOUCHES, out_of_reach
from retarget_bench.datasets.puppets.generator.solver.solve import solve

ALL = tuple(name for family in families() for name in family.bodies)


def every(data: Puppets) -> list[CaseInfo]:
    return [info for split in SPLITS for info in data.cases("retarget", split)]


CORPORA = [
    ("tiny", "test", 150),
    ("default", "test", 2000),
    ("tiny", "validation", 150),
    ("default", "validation", 300),
]


@pytest.mark.parametrize(("size", "part", "most"), CORPORA)
def test_cases_are_fixed_balanced_and_in_the_right_split(size: str, part: str, most: int) -> None:
    data, again = Puppets(size=size, part=part), Puppets(size=size, part=part)
    cast = data.characters()
    infos = every(data)
    assert [info.id for info in infos] == [info.id for info in every(again)]
    assert 0.6 * most < len(infos) <= most
    assert len({info.id for info in infos}) == len(infos)
    for info in infos:
        alike = cast[info.source].structure == cast[info.target].structure
        expected = "self" if info.source == info.target else "intra" if alike else "cross"
        assert (info.split, info.task) == (expected, "retarget")
        assert info.id == f"puppets/{info.source}>{info.target}/{info.clip}"


@pytest.mark.parametrize(("size", "part", "most"), CORPORA)
def test_every_character_and_kind_is_in_every_split(size: str, part: str, most: int) -> None:
    """As source and as target, about equally often within a family; dogs are one structure: no cross.
    In validation every case has one of those whom training goes without, and these are all there."""
    del most
    data = Puppets(size=size, part=part)
    for family in families():
        names, kinds = bodies_of(family, part), kinds_of(family, part)
        aside = {name for name in names if name in VALIDATION_BODIES and part == "validation"}
        structures = {family.bodies[name].structure.name for name in names}
        for split in SPLITS:
            cases = [info for info in data.cases("retarget", split) if info.kind in kinds]
            if split == "cross" and len(structures) == 1:
                assert not cases
                continue
            assert {info.kind for info in cases} == set(kinds)
            for side in ("source", "target"):
                count = Counter(getattr(info, side) for info in cases)
                assert set(count) >= (aside or set(names))
                for equals in (aside, set(names) - aside):
                    numbers = [count[name] for name in equals]
                    assert max(numbers, default=0) <= 2 + 1.6 * min(numbers, default=0)
            if aside:
                assert all({info.source, info.target} & aside for info in cases)


def test_sizes_are_what_they_say() -> None:
    tiny, default = ({i.clip: i.frames for i in every(Puppets(size=s))} for s in ("tiny", "default"))
    assert 60 <= min(tiny.values()) < max(tiny.values()) <= 120
    assert len(default) == 106
    lengths = sorted(default.values())
    assert sum(frames == 1800 for frames in lengths) >= 8
    assert 90 <= lengths[0] < max(f for f in lengths if f < 1800) <= 240
    large = Puppets(size="large")
    assert every(large) == every(Puppets(size="default"))
    hours = sum(c.frames for cast in large.training().values() for c in cast.values()) / 30 / 3600
    assert hours > 20


@pytest.mark.parametrize("part", ["test", "validation"])
def test_a_pair_does_four_clips_of_a_kind(part: str) -> None:
    """Every kind but sequences, in each split by one pair of bodies; dogs are one structure: no cross."""
    data = Puppets(size="kinds", part=part)
    for family in families():
        kinds = set(kinds_of(family, part)) - {family.sequence}
        structures = {body.structure.name for body in family.bodies.values()}
        for split in SPLITS:
            cases = [info for info in data.cases("retarget", split) if info.kind in kinds]
            groups: dict[str, list[CaseInfo]] = {}
            for info in cases:
                groups.setdefault(info.kind, []).append(info)
            assert set(groups) == (set() if split == "cross" and len(structures) == 1 else kinds)
            for group in groups.values():
                assert len({info.clip for info in group}) == len(group) == 4
                assert len({info.pair for info in group}) == 1
                for info in group:
                    assert not {info.source, info.target} & set(data.exclusions().get(info.clip, ()))
    assert Puppets(size="kinds").training_manifest() == Puppets().training_manifest()


def test_a_name_stands_for_one_clip() -> None:
    """Between sizes and parts no name is used twice, save that large is tested on what default is, and that
    kinds has the training of tiny."""
    names: list[str] = []
    for size in ("tiny", "default", "large", "kinds"):
        data = Puppets(size=size)
        for part in data.parts().values():
            names += sorted({info.clip for info in every(part)}) if size != "large" else []
        if size != "kinds":
            names += [name for cast in data.training().values() for c in cast.values() for name in c.names]
    assert len(set(names)) == len(names)


def test_training_is_unpaired_and_without_what_is_held_out() -> None:
    data = Puppets(size="default")
    manifest = data.training_manifest()
    names: list[str] = []
    for structure, cast in data.training().items():
        assert structure not in HELD_OUT_STRUCTURES
        assert structure in manifest["structures"]
        for name, own in cast.items():
            assert name in manifest["characters"]
            assert name not in manifest["validation"]
            assert data.characters()[name].structure == structure
            assert len(own) == len(own.names) > 20
            names += own.names
    kinds = {name.split("-")[0] for name in names}
    assert kinds == set(manifest["kinds"])
    assert not kinds & set(HELD_OUT_KINDS)
    assert len(set(names)) == len(names)
    one = next(iter(data.training()["body22"].values()))
    assert one[0].frames == one[:1].frames
    assert one[0].character.name == one.character


@pytest.mark.parametrize("size", ["tiny", "default"])
def test_training_is_steered_by_bodies_that_it_goes_without(size: str) -> None:
    """One of each structure that is trained on; other clips than those of the test and of the training."""
    data = Puppets(size=size)
    validation = data.validation()
    cast = data.characters()
    trained = {name: c for bodies in data.training().values() for name, c in bodies.items()}
    aside = set(data.training_manifest()["validation"])
    assert Counter(cast[name].structure for name in aside) == Counter(list(data.training()))
    assert set(data.training_manifest()["characters"]) == aside | set(trained)
    for split in SPLITS:
        targets = [info.target for info in validation.cases("retarget", split)]
        assert sum(name in aside for name in targets) >= 0.4 * len(targets)
    steering = {info.clip for info in every(validation)}
    assert not steering & {info.clip for info in every(data)}
    assert not steering & {clip for c in trained.values() for clip in c.names}
    for info in every(validation):
        assert {info.source, info.target} & aside
        assert {info.source, info.target} <= aside | set(trained)


def test_what_is_unseen_is_marked() -> None:
    data = Puppets(size="default")
    manifest = data.training_manifest()
    marks = Counter()
    for split in SPLITS:
        for info in data.cases("retarget", split):
            new = data.unseen(info)
            assert ("source" in new) == (info.source not in manifest["characters"])
            assert ("target" in new) == (info.target not in manifest["characters"])
            assert ("kind" in new) == (info.kind not in manifest["kinds"])
            marks[split, "target" in new or "source" in new, "kind" in new] += 1
    validation = Puppets(size="default", part="validation")
    assert not any(validation.unseen(info) for info in every(validation))
    # each of the four combinations, in every split
    assert len(marks) == 12
    assert min(marks.values()) >= 10


def test_bodies_are_left_out_of_what_they_cannot_reach() -> None:
    """What is published is what solving finds, to the millimetre it is written with."""
    data = Puppets()
    left_out = data.exclusions()
    listed = {info.clip for info in every(data)}
    for number, clip in enumerate(clips("tiny", 0)):
        assert clip.name in listed
        gaps = left_out.get(clip.name, {})
        tried = tuple({*gaps, *bodies_of(clip.family, "test")[number % 6 :: 6]})
        short = shortfalls(clip, tried)
        assert set(short) == set(gaps) & set(tried), clip.name
        for name, gap in short.items():
            assert gap > TOUCHES
            assert abs(gap - gaps[name]) < 1e-3
    for info in every(data):
        assert not {info.source, info.target} & set(left_out.get(info.clip, {}))
    assert left_out == {} or "Left out" in data.notes[1]


def test_another_seed_finds_its_own_exclusions() -> None:
    """They are solved for when they are asked for, with the same outcome as for the published corpus."""
    clip = next(clip for clip in clips("tiny", 0) if unable(clip, ALL))
    other = replace(clip, seed=5)
    short = unable(other, tuple(clip.family.bodies))
    for name in list(clip.family.bodies)[::9]:
        body, score = clip.family.bodies[name], other.score()
        gaps = out_of_reach(score, body, solve(score, body))
        assert (name in short) == bool(gaps)
