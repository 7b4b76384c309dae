"""Puppets as a data set: cases, cache, and the same motion everywhere."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from puppet_takes import touch_gap

from retarget_bench.api import CaseInfo
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.generator.bodies.characters import BODIES
from retarget_bench.datasets.puppets.generator.corpus.clips import clips
from retarget_bench.datasets.puppets.generator.randomness import Stream
from retarget_bench.datasets.puppets.generator.solver.solve import solve
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion.contact import CONTACT_ROLES
from retarget_bench.motion.rotation import to_matrix
from retarget_bench.motion.transfer import relative


def test_a_case_is_complete() -> None:
    data = Puppets()
    for info in data.cases("retarget", "cross")[::7]:
        case = data.load(info)
        assert case.source.character is data.characters()[info.source]
        assert case.target is data.characters()[info.target]
        assert case.reference is not None
        assert case.reference.character is case.target
        assert case.source.fps == case.reference.fps == 30.0
        assert case.source.frames == case.reference.frames == info.frames
        assert case.contacts is not None
        assert case.contacts.roles == tuple(role for role in CONTACT_ROLES if role in case.target.joint_of)
        assert case.contacts.planted.shape == (info.frames, len(case.contacts.roles))
        toes = [k for k, role in enumerate(case.contacts.roles) if role.endswith("toe")]
        resting = case.contacts.planted.any(axis=0)
        assert (resting[toes] if info.kind == "crawl" else resting).all()  # who crawls rests on toes only
        assert case.ground.height == 0.0


def test_self_cases_answer_themselves_and_others_do_not() -> None:
    data = Puppets()
    same = data.load(data.cases("retarget", "self")[3])
    assert np.array_equal(same.source.rotations, same.reference.rotations)
    other = data.load(data.cases("retarget", "intra")[0])
    assert np.abs(other.source.positions - other.reference.positions).max() > 0.05


def test_wrong_requests_are_refused_in_words() -> None:
    with pytest.raises(BenchError, match=r"size 'huge'.*tiny, default"):
        Puppets(size="huge")  # type: ignore[arg-type]
    with pytest.raises(BenchError, match=r"part 'train'.*validation"):
        Puppets(part="train")  # type: ignore[arg-type]
    data = Puppets()
    with pytest.raises(NotSupported, match="denoise"):
        data.cases("denoise", "cross")
    info = data.cases("retarget", "cross")[0]
    with pytest.raises(BenchError, match="no case"):
        data.load(CaseInfo("puppets/a>b/c", "retarget", "cross", info.source, info.target, "jump-01"))


def test_feet_are_planted_pivoting_or_free() -> None:
    """Whatever pivots does so about a point of its foot that stays where it is."""
    data, count = Puppets(), 0
    for info in data.cases("retarget", "intra"):
        if info.kind not in ("walk", "arc", "march"):
            continue
        case, body = data.load(info), BODIES[info.target]
        if body.structure.name == "h36m17":  # has no toe joint to pivot about
            continue
        pivoting, planted = case.contacts.pivoting, case.contacts.planted
        assert not (pivoting & planted).any()
        turned = to_matrix(relative(case.reference))
        sizes = body.proportions
        points = {
            "foot": ([0, -sizes.ankle, -sizes.heel], [0, sizes.ball_height - sizes.ankle, sizes.ball]),
            "toe": ([0, 0, 0], [0, 0, sizes.toes]),
        }
        for column, side in ((0, "left"), (2, "right")):
            moves = []
            for part, offsets in points.items():
                joint = body.part[f"{side}_{part}"]
                for offset in offsets:
                    place = case.reference.positions[:, joint] + turned[:, joint] @ np.array(offset)
                    moves.append(np.linalg.norm(np.diff(place, axis=0), axis=-1))
            rests = np.min(moves, axis=0)
            for k in (column, column + 1):
                assert rests[pivoting[1:, k]].max(initial=0.0) < 1e-3, info.id
                count += int(pivoting[:, k].sum())
    assert count > 100


def test_kind_phase_and_touches_are_known_for_every_frame() -> None:
    data, touched = Puppets(), Counter()
    for info in data.cases("retarget", "self"):
        labels = data.labels(info)
        assert labels.kind.shape == labels.phase.shape == (info.frames,)
        assert np.isfinite(labels.phase).all()
        if not info.kind.endswith("sequence"):
            assert set(labels.kind) == {info.kind}
        for name, label in labels.touches.items():
            assert label.shape == (info.frames,)
            touched[name] += int(label.sum())
    assert len(touched) > 4


def test_touches_of_cases_are_the_labelled_ones_and_touch() -> None:
    """Every hand on a place of the own body that the labels name, where the rig has the place's joint."""
    data, counts = Puppets(), Counter()
    for info in data.cases("retarget", "self"):
        case = data.load(info)
        labels = {k: v for k, v in data.labels(info).touches.items() if not k.endswith(("floor", "thing"))}
        assert len(case.touches) <= len(labels)
        assert len(case.touches) == len(labels) or case.target.structure == "h36m17"
        for touch in case.touches:
            assert any(np.array_equal(touch.rests, label) for label in labels.values())
            assert touch_gap(case.reference, touch).max() < 0.01, info.id
            counts[touch.bearing] += 1
    assert len(counts) > 3


def test_the_second_answer_is_another_one_with_the_same_contacts() -> None:
    data = Puppets()
    for info in data.cases("retarget", "intra")[::4]:
        case = data.load(info)
        apart = case.alternative.positions - case.reference.positions
        assert np.linalg.norm(apart, axis=-1).mean() > 5e-4 * case.target.height, info.id
        if (case.contacts.roles) == CONTACT_ROLES:
            feet = apart[:, case.target.joints([r for r in CONTACT_ROLES if r in case.target.joint_of])]
            assert np.abs(feet * case.contacts.planted[:, : feet.shape[1], None]).max() < 2e-6, info.id


def test_no_last_digit_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Random numbers that differ by 1e-12 give motions that differ by less than 1e-8 m."""

    def motions() -> list[np.ndarray]:
        places = []
        for number, clip in enumerate(clips("tiny", 0)):
            score = clip.score()
            for body in list(clip.family.bodies.values())[number % 18 :: 18]:
                solution = solve(score, body)
                places.append(body.positions(solution.orientations, solution.root))
        return places

    exact, draw = motions(), Stream._units
    monkeypatch.setattr(Stream, "_units", lambda self, n: [u * (1.0 - 1e-12) for u in draw(self, n)])
    for one, other in zip(exact, motions(), strict=True):
        assert 0.0 < np.abs(one - other).max() < 1e-8


def test_another_seed_is_another_corpus() -> None:
    first, second = Puppets(), Puppets(seed=1)
    assert len({first.content, second.content, Puppets(size="default").content}) == 3
    one, other = first.motion("wave-001", "ada"), second.motion("wave-001", "ada")
    assert one.frames != other.frames or np.abs(one.positions - other.positions).max() > 0.05
