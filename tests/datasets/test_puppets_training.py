"""Drawn training bodies and exact pairs: what is held out stays out, all is the same every time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from puppet_takes import restlessness, touch_gap

from retarget_bench.api import TrainingPair
from retarget_bench.commands.train import command
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.generator.bodies import rigs
from retarget_bench.datasets.puppets.generator.conventions import FPS
from retarget_bench.datasets.puppets.generator.corpus import clip_solver
from retarget_bench.datasets.puppets.generator.corpus.clips import Clip
from retarget_bench.datasets.puppets.generator.corpus.families import (
    HELD_OUT_KINDS,
    HELD_OUT_STRUCTURES,
    VALIDATION_BODIES,
    build,
    families,
    only_tested,
)
from retarget_bench.datasets.puppets.generator.corpus.pairs import TROUPE
from retarget_bench.datasets.puppets.generator.corpus.training_bodies import LEAST_UNLIKE, training_bodies
from retarget_bench.errors import BenchError, Unusable
from retarget_bench.motion import rotation
from retarget_bench.training.stored_pairs import stored

NUMBER = 120
CAST = [body for family in families() for body in family.bodies.values()]
APART = [body for body in CAST if only_tested(body) or body.name in VALIDATION_BODIES]


def test_drawn_bodies_are_a_list_that_grows() -> None:
    few, many = training_bodies(0, 5), training_bodies(0, NUMBER)
    assert list(few) == list(many)[:5]
    assert [few[name].proportions for name in few] == [many[name].proportions for name in few]
    others = training_bodies(1, 5)
    assert all(others[name].proportions != few[name].proportions for name in few)
    assert not set(many) & {body.name for body in CAST}


def test_they_are_of_all_structures_that_are_trained_on_and_no_other() -> None:
    structures = {body.structure.name for body in training_bodies(0, NUMBER).values()}
    assert structures == {body.structure.name for body in CAST} - set(HELD_OUT_STRUCTURES)
    assert {body.rest for body in training_bodies(0, NUMBER).values()} == set(rigs.RESTS)


@pytest.mark.parametrize("apart", APART, ids=lambda body: body.name)
def test_none_is_built_like_a_body_that_is_held_out(apart: object) -> None:
    for body in training_bodies(0, NUMBER).values():
        difference = np.abs(build(body.proportions) - build(apart.proportions))  # type: ignore[attr-defined]
        assert difference.max() >= LEAST_UNLIKE, body.name


def test_they_vary_at_least_as_much_as_the_cast() -> None:
    """Each ratio of lengths of people spreads wider than among the bodies of the test, thickness too."""
    people = [body for body in training_bodies(0, NUMBER).values() if body.structure.name != "dog21"]
    cast = [body for body in CAST if body.structure.name != "dog21" and not body.held_out]
    drawn, usual = (np.array([build(body.proportions) for body in each]) for each in (people, cast))
    assert (drawn.std(axis=0) > 0.75 * usual.std(axis=0)).all()
    girth = np.array([body.proportions.girth / body.proportions.leg for body in people])
    assert girth.max() > 3.0 * girth.min()


def test_a_number_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(BenchError, match="0 to 9999"):
        Puppets(bodies=-1)


def test_cases_and_the_training_of_the_cast_stay_as_they_are() -> None:
    plain, drawn = Puppets(size="default"), Puppets(size="default", bodies=NUMBER)
    for split in ("self", "intra", "cross"):
        assert plain.cases("retarget", split) == drawn.cases("retarget", split)
        assert plain.validation().cases("retarget", split) == drawn.validation().cases("retarget", split)
    for structure, cast in plain.training().items():
        for name, clips in cast.items():
            fewer = drawn.training()[structure][name]
            assert fewer.names == clips.names[: len(fewer)]
    assert plain.content != drawn.content
    assert "bodies" not in Puppets().content


def test_the_motion_of_a_size_is_shared_out() -> None:
    hours = [
        sum(
            clips.frames
            for cast in Puppets(size="large", bodies=k).training().values()
            for clips in cast.values()
        )
        for k in (0, NUMBER)
    ]
    assert 0.95 < hours[1] / hours[0] < 1.1


def test_nobody_and_nothing_that_is_held_out_is_trained_on() -> None:
    data = Puppets(size="tiny", bodies=NUMBER)
    names = {name for cast in data.training().values() for name in cast}
    kinds = {
        clip.rsplit("-", 2)[0]
        for cast in data.training().values()
        for c in cast.values()
        for clip in c.names
    }
    assert not names & {body.name for body in APART}
    assert len(names) == NUMBER + len(CAST) - len(APART)
    assert not kinds & set(HELD_OUT_KINDS)
    assert not set(data.training()) & set(HELD_OUT_STRUCTURES)
    assert set(training_bodies(0, NUMBER)) < set(data.training_manifest()["characters"])
    tested = {
        clip
        for split in ("self", "intra", "cross")
        for clip in (i.clip for i in data.cases("retarget", split))
    }
    assert not tested & {
        clip for cast in data.training().values() for c in cast.values() for clip in c.names
    }


def test_drawn_bodies_move_well(cache: Path) -> None:
    """Their motion is finite, joints at rest stay within a millimetre, nothing goes through the floor and
    nothing jumps; who cannot do a clip is left out of it."""
    assert cache
    data = Puppets(size="tiny", bodies=40)
    count = left_out = 0
    for cast in data.training().values():
        for name, clips in cast.items():
            if name not in training_bodies(0, 40):
                continue
            try:
                motion = clips[0]
            except Unusable:
                left_out += 1
                continue
            count += 1
            contacts = data._generated.solver.contacts(clips.listed[0], name)
            assert restlessness(motion, contacts) < 1e-3, clips.names[0]
            assert motion.positions[..., 1].min() > -0.005, clips.names[0]
            turn = np.degrees(rotation.angle(motion.rotations[:-1], motion.rotations[1:]))
            assert turn.max() < 60.0, clips.names[0]
    assert count >= 36
    assert left_out <= 4


def test_a_clip_that_a_drawn_body_cannot_do_is_unusable(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert cache
    data = Puppets(bodies=1)
    monkeypatch.setattr(clip_solver, "out_of_reach", lambda *_: {"left hand": 0.1})
    with pytest.raises(Unusable, match="cannot reach"):
        data.training()["body22"]["body22_0000"][0]


@pytest.fixture(scope="module")
def pairs() -> list[TrainingPair]:
    """Some pairs of every other performance of a small corpus."""
    every_pair = Puppets(size="tiny", bodies=30).training_pairs()
    numbers = range(0, len(every_pair), 2 * every_pair.together)
    return [every_pair[number + place] for number in numbers for place in (0, 23)]


def test_pairs_are_the_same_performance_by_two_bodies(pairs: list[TrainingPair]) -> None:
    for pair in pairs:
        source, target = pair.source.motion, pair.target.motion
        assert pair.exact
        assert source.character.name != target.character.name
        assert (source.frames, source.fps) == (target.frames, target.fps) == (source.frames, FPS)
        assert 2.0 <= source.frames / FPS <= 4.0 + 1 / FPS
    structures = {(p.source.motion.character.structure, p.target.motion.character.structure) for p in pairs}
    assert len(structures) >= 8


def test_pairs_have_nothing_that_is_held_out(pairs: list[TrainingPair]) -> None:
    for pair in pairs:
        assert pair.kind not in HELD_OUT_KINDS
        names = {each.motion.character.name for each in (pair.source, pair.target)}
        assert not names & {body.name for body in APART}


def test_contacts_of_pairs_agree(pairs: list[TrainingPair]) -> None:
    """Feet of both are planted in the same frames, where both have the joint; and planted joints rest."""
    for pair in pairs:
        one, other = pair.source.contacts, pair.target.contacts
        assert one is not None
        assert other is not None
        for role in set(one.roles) & set(other.roles):
            columns = one.planted[:, one.roles.index(role)], other.planted[:, other.roles.index(role)]
            assert (columns[0] == columns[1]).mean() > 0.97, (pair.clip, role)
        for each, contacts in ((pair.source, one), (pair.target, other)):
            assert restlessness(each.motion, contacts) < 1e-3, pair.clip


def test_touches_of_pairs_are_the_same_and_touch(pairs: list[TrainingPair]) -> None:
    touching = 0
    for pair in pairs:
        one, other = pair.source.touches, pair.target.touches
        assert one is not None
        assert other is not None
        assert [(t.end, t.bearing) for t in one] == [(t.end, t.bearing) for t in other]
        for each in (pair.source, pair.target):
            for touch in each.touches or ():
                gap = touch_gap(each.motion, touch).max(initial=0.0)
                assert gap < 0.012, (pair.clip, touch.end, touch.bearing)
                touching += 1
    assert touching > 10


def test_pairs_are_the_same_every_time(cache: Path) -> None:
    """Whether made, read, or asked for in another order; another seed has others."""
    assert cache
    first, again = (Puppets(size="tiny", bodies=30).training_pairs() for _ in range(2))
    drawn = [first[index] for index in (3, 200, 57)]
    read = [again[index] for index in (200, 3, 57, -len(again) + 3)]
    for one, other in ((drawn[0], read[1]), (drawn[1], read[0]), (drawn[2], read[2]), (drawn[0], read[3])):
        for side, other_side in ((one.source, other.source), (one.target, other.target)):
            np.testing.assert_array_equal(side.motion.rotations, other_side.motion.rotations)
            np.testing.assert_array_equal(side.motion.root, other_side.motion.root)
    other = Puppets(size="tiny", bodies=30, seed=1).training_pairs()[3]
    assert other.source.motion.root.shape != drawn[0].source.motion.root.shape or not np.array_equal(
        other.source.motion.root, drawn[0].source.motion.root
    )
    with pytest.raises(IndexError):
        first[len(first)]


def test_damaged_files_are_made_anew(tmp_path: Path) -> None:
    def file(name: str) -> Any:
        return stored(tmp_path / f"{name}.safetensors", lambda: ({"x": np.full(9, len(name))}, {}))

    file("one"), file("three")
    path, other = tmp_path / "one.safetensors", tmp_path / "three.safetensors"
    content = path.read_bytes()
    for harm in (*(content[:end] for end in (0, 7, 100, len(content) - 1)), other.read_bytes()):
        path.unlink()
        path.write_bytes(harm)
        np.testing.assert_array_equal(file("one").get_tensor("x"), np.full(9, 3))
        assert path.read_bytes() == content
    path.unlink()
    path.mkdir()
    np.testing.assert_array_equal(file("one").get_tensor("x"), np.full(9, 3))


def test_every_ordered_pair_of_a_troupe_comes_once(cache: Path) -> None:
    assert cache
    every_pair = Puppets(size="tiny", bodies=30).training_pairs()
    some = [every_pair[index] for index in range(every_pair.together)]
    names = {(p.source.motion.character.name, p.target.motion.character.name) for p in some}
    assert len(names) == every_pair.together == TROUPE * (TROUPE - 1)
    assert {name for pair in names for name in pair} == set(every_pair.troupe(0))
    assert isinstance(every_pair.clip(0), Clip)


@pytest.mark.slow
def test_all_is_made_beforehand(cache: Path) -> None:
    """``bench train --prepare`` leaves nothing to be solved, and a second time has nothing to do."""
    result = CliRunner().invoke(command, ["--prepare", "-d", "puppets[bodies=3]", "-j", "2"])
    assert result.exit_code == 0, result.output
    files = {path: path.stat().st_mtime_ns for path in cache.rglob("puppets/**/*.*")}
    assert sum(path.suffix == ".safetensors" for path in files) == 40
    assert sum(path.suffix == ".npz" for path in files) >= 60
    again = CliRunner().invoke(command, ["--prepare", "-d", "puppets[bodies=3]", "-j", "1"])
    assert again.stdout == result.stdout
    assert {path: path.stat().st_mtime_ns for path in cache.rglob("puppets/**/*.*")} == files
