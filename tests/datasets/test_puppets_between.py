"""Puppets between legs: from people to dogs and back, nothing known of the right answer."""

from __future__ import annotations

from collections import Counter

import pytest

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion.actions import action

SIZES = (("tiny", 26), ("default", 390))


@pytest.mark.parametrize(("size", "most"), SIZES)
def test_both_ways_have_as_many_cases_and_every_clip_and_body_its_turn(size: str, most: int) -> None:
    data = Puppets(size=size, between="legs")
    cast = data.characters()
    infos = data.cases("retarget", "cross")
    assert [info.id for info in infos] == [
        i.id for i in Puppets(size=size, between="legs").cases("retarget", "cross")
    ]
    assert len({info.id for info in infos}) == len(infos)
    ways = Counter(cast[info.target].four_legged for info in infos)
    assert ways == {True: most, False: most}
    for info in infos:
        assert cast[info.source].four_legged != cast[info.target].four_legged
        assert info.kind in ("idle", "move", "sit")
    for four in (True, False):
        targets = Counter(info.target for info in infos if cast[info.target].four_legged == four)
        clips = Counter(info.clip for info in infos if cast[info.target].four_legged == four)
        if size == "default":
            assert set(targets) == {name for name, body in cast.items() if body.four_legged == four}
            assert max(targets.values()) <= min(targets.values()) + 1 + 2 * (not four)
            assert max(clips.values()) <= min(clips.values()) + 1


def test_no_case_has_a_reference_and_real_motion_is_the_tests_own() -> None:
    data, usual = Puppets(between="legs"), Puppets()
    cast = data.characters()
    infos = data.cases("retarget", "cross")
    for info in (infos[0], infos[-1]):
        case = data.load(info)
        assert case.reference is None
        assert case.alternative is None
        assert case.contacts is None
        assert case.touches is None
        assert case.target is cast[info.target]
        assert (case.source.positions == usual.motion(info.clip, info.source).positions).all()
    performed = {
        (info.clip, name)
        for split in usual.card.splits
        for info in usual.cases("retarget", split)
        for name in (info.source, info.target)
    }
    structures = {body.structure for body in cast.values()}
    real = [info for structure in structures for info in data.real("retarget", structure)]
    assert {(info.clip, info.target) for info in real} <= performed
    assert {clip for clip, _ in performed} - {info.clip for info in real} == {
        "stairs_up-001",
        "stairs_down-001",
    }
    (info, *_) = data.real("retarget", "dog21")
    assert (data.load(info).reference.positions == usual.motion(info.clip, info.target).positions).all()
    assert cast[info.target].structure == "dog21"


def test_kinds_are_those_of_the_motion() -> None:
    """Told from scores; the rule that looks at motion agrees, but for seats, which are above the floor."""
    data = Puppets(between="legs")
    infos = {
        info.clip: info for structure in ("body22", "dog21") for info in data.real("retarget", structure)
    }
    disagree = []
    for info in infos.values():
        kind = action(data.load(info).source)
        if kind != info.kind and info.kind != "sit":
            disagree.append((info.clip, info.kind, kind))
    assert len(infos) > 40
    assert len(disagree) <= 0.1 * len(infos), disagree
    assert {
        action(data.load(info).source) for info in infos.values() if info.clip.startswith("dog_sit")
    } == {"sit"}


def test_training_is_the_corpus_own_and_its_validation_has_references() -> None:
    legs, usual = Puppets(between="legs"), Puppets()
    names = {n for cast in legs.training().values() for clips in cast.values() for n in clips.names}
    assert names == {
        n for cast in usual.training().values() for clips in cast.values() for n in clips.names
    }
    assert legs.validation().cases("retarget", "intra") == usual.validation().cases("retarget", "intra")
    assert not names & {info.clip for info in legs.cases("retarget", "cross")}


def test_mistakes_are_told() -> None:
    with pytest.raises(BenchError, match="between structures or legs, and not between=arms"):
        Puppets(between="arms")  # type: ignore[arg-type]
    with pytest.raises(NotSupported, match="splits cross; asked for retarget self"):
        Puppets(between="legs").cases("retarget", "self")
    with pytest.raises(BenchError, match="has no case"):
        Puppets().load(Puppets(between="legs").cases("retarget", "cross")[0])
