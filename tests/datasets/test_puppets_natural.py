"""Version 1.1 of the puppets, and sources with the noise of capture, as a data set."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from puppet_takes import restlessness, touch_gap

import retarget_bench
from retarget_bench.api import Case, CaseInfo
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.generator.corpus import capture
from retarget_bench.datasets.puppets.generator.corpus.capture import captured
from retarget_bench.datasets.puppets.generator.randomness import Stream
from retarget_bench.errors import BenchError
from retarget_bench.motion.contact import planted, runs
from retarget_bench.motion.motion import Motion


@pytest.fixture(autouse=True)
def _own_cache(cache: Path) -> None:
    assert cache


def some(data: Puppets, *kinds: str) -> Iterator[tuple[CaseInfo, Case]]:
    for info in data.cases("retarget", "intra"):
        if info.kind in kinds:
            yield info, data.load(info)


def path(motion: Motion, role: str) -> np.ndarray:
    """``(frames, 3)`` metres."""
    return motion.positions[:, motion.character.joint_of[role]]


def straightest(motion: Motion, limb: tuple[str, str, str]) -> float:
    """The least angle between two bones of the left limb, degrees."""
    top, middle, end = (path(motion, f"left_{part}") for part in limb)
    upper, lower = middle - top, end - middle
    cosine = (upper * lower).sum(axis=-1) / np.linalg.norm(upper, axis=-1) / np.linalg.norm(lower, axis=-1)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)).min()))


def quick(steps: np.ndarray) -> float:
    """Share of the energy of ``(frames, 3)`` above 6 Hz."""
    energy = (np.abs(np.fft.rfft(steps * np.hanning(len(steps))[:, None], axis=0)) ** 2).sum(axis=1)
    return float(energy[np.fft.rfftfreq(len(steps), 1 / 30) > 6.0].sum() / energy.sum())


def test_it_has_the_cases_and_contacts_of_the_first_one_and_other_motion() -> None:
    first, natural = Puppets(), Puppets(version="1.1")
    for split in first.card.splits:
        assert natural.cases("retarget", split) == first.cases("retarget", split)
    assert natural.training_manifest() == first.training_manifest()
    assert {p: d.label for p, d in natural.parts().items()} == {
        "test": "puppets-1.1 tiny",
        "validation": "puppets-1.1 tiny, validation",
    }
    assert "1.1" in natural.content
    assert "1.1" in natural.validation().content
    clips = [data.training()["body22"]["ada"][0] for data in (first, natural)]
    assert np.abs(clips[0].positions - clips[1].positions).max() > 1e-3
    for info, case in islice(some(natural, "walk", "clap", "dog_stand"), 6):
        before = first.load(info)
        assert np.array_equal(case.contacts.planted, before.contacts.planted)
        assert np.array_equal(case.contacts.pivoting, before.contacts.pivoting)
        off = np.linalg.norm(case.reference.positions - before.reference.positions, axis=-1)
        assert 2e-4 < off.mean() < 0.02, info.id
        for touch in case.touches:
            assert touch_gap(case.reference, touch).max() < 0.01, info.id


def test_feet_are_never_quite_still_and_stay_where_contacts_are_found() -> None:
    """Within half a per cent of the height, where the metric of contacts looks, and alike on all bodies."""
    for info, case in some(Puppets(version="1.1"), "stand", "wave", "dog_stand"):
        moved = {}
        for motion in (case.source, case.reference, case.alternative):
            leg, role = motion.character.measures.leg_length, case.contacts.roles[0]
            rests = case.contacts.planted[:, 0]
            foot, step = path(motion, role), np.diff(path(motion, role), axis=0)[rests[1:]]
            assert np.median(np.linalg.norm(step, axis=-1)) > 5e-5 * leg, info.id
            for begin, end in runs(rests):
                apart = foot[begin:end] - foot[begin:end].mean(axis=0)
                assert np.abs(apart[:, 1]).max() < 1e-6, info.id
                assert np.linalg.norm(apart, axis=-1).max() < 0.005 * case.target.height, info.id
            moved[motion is case.source] = foot[rests] - foot[rests][0]
        assert 1e-4 < restlessness(case.reference, case.contacts) < 2e-3, info.id
        if info.kind == "stand":
            shares = [np.linalg.norm(moved[whose], axis=-1).max() for whose in (True, False)]
            legs = [each.measures.leg_length for each in (case.source.character, case.target)]
            assert shares[0] / shares[1] == pytest.approx(legs[0] / legs[1], rel=0.2)


def test_limbs_straighten_and_hands_are_unsteady() -> None:
    knees, elbows, shares = [], [], []
    for data in (Puppets(), Puppets(version="1.1")):
        motions = [case.reference for _, case in some(data, "walk", "arc", "point", "punch", "throw")]
        knees.append([straightest(motion, ("up_leg", "leg", "foot")) for motion in motions])
        elbows.append([straightest(motion, ("arm", "forearm", "hand")) for motion in motions])
        shares.append([quick(np.diff(path(motion, "left_hand"), axis=0)) for motion in motions])
    assert min(knees[0]) > 10.0
    assert 1.0 < min(knees[1]) < 7.0
    assert 1.0 < min(elbows[1]) < min(elbows[0])
    assert np.median(shares[0]) < 0.003
    assert 0.004 < np.median(shares[1]) < 0.03


@pytest.mark.parametrize("version", ["1.0", "1.1"])
def test_captured_sources_are_noisy_and_nothing_else_is(version: str) -> None:
    exact, noisy = (Puppets(version=version, source=source) for source in ("exact", "captured"))
    assert noisy.cases("retarget", "self") == exact.cases("retarget", "self")
    for info in noisy.cases("retarget", "self")[::9]:
        case, expected = noisy.load(info), exact.load(info)
        assert case.target is noisy.characters()[info.target]
        for one, other in ((case.reference, expected.reference), (case.alternative, expected.alternative)):
            assert np.array_equal(one.positions, other.positions)
            assert np.array_equal(one.rotations, other.rotations)
        assert np.array_equal(case.contacts.planted, expected.contacts.planted)
        long = case.source.skeleton.bone_lengths / np.maximum(expected.source.skeleton.bone_lengths, 1e-9)
        roles = {role for role, ratio in zip(case.target.roles, long, strict=True) if ratio > 1.001}
        assert roles in ({"left_leg", "left_foot"}, {"right_leg", "right_foot"})
        assert long[case.target.joints(sorted(roles))] == pytest.approx(1.02)
        again = Puppets(version=version, source="captured").load(info)
        assert np.array_equal(again.source.rotations, case.source.rotations)
    assert (noisy.label, noisy.content) == (
        f"{exact.label}, sources captured",
        f"{exact.content}, source captured",
    )
    assert noisy.validation().label == f"{exact.label}, sources captured, validation"


def test_captured_joints_jitter_by_a_millimetre_or_two_and_a_foot_sinks_by_a_centimetre(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of clean motion: what is white in the difference, then what is left without the jitter."""
    for _, case in some(Puppets(), "wave", "walk", "dog_stand"):
        clean = case.source
        off = captured(clean, Stream("capture")).positions - clean.positions
        white = np.diff(off, 2, axis=0) / np.sqrt(6.0)  # of white noise as large as the noise
        sizes = np.sqrt((white**2).sum(axis=-1)).mean(axis=0)
        assert 0.7e-3 < np.median(sizes) < 2e-3
        with monkeypatch.context() as patch:
            patch.setattr(capture, "_ROOT", 0.0)
            patch.setattr(capture, "_BONES", 0.0)
            sunk = captured(clean, Stream("capture"))
        feet = [path(sunk, f"{side}_foot") - path(clean, f"{side}_foot") for side in ("left", "right")]
        which = int(np.abs(feet[1]).max() > np.abs(feet[0]).max())
        assert np.abs(feet[1 - which]).max() < 1e-9
        foot = path(clean, ("left_foot", "right_foot")[which])[:, None]
        rests = planted(foot, clean.character.height, clean.fps)[:, 0]
        for begin, end in runs(rests):
            if end - begin > 14:
                assert feet[which][begin + 7 : end - 7, 1] == pytest.approx(-0.01, abs=2e-3)
        assert np.abs(feet[which][:, [0, 2]]).max() < 4e-3


def test_wrong_values_are_told_in_a_sentence() -> None:
    with pytest.raises(BenchError, match=r"puppets: there is no version '2'; versions are 1\.0, 1\.1"):
        Puppets(version="2")  # type: ignore[arg-type]
    with pytest.raises(BenchError, match="puppets: source is exact or captured, and not noisy"):
        Puppets(source="noisy")  # type: ignore[arg-type]
    with pytest.raises(BenchError, match="source=captured goes with between=structures"):
        Puppets(source="captured", between="legs")


@pytest.mark.slow
def test_a_run_on_both_says_what_it_is_of(tmp_path: Path) -> None:
    run = retarget_bench.run(
        "copy_rotations",
        dataset="puppets[version=1.1,source=captured]",
        splits="cross",
        limit=1,
        out=tmp_path,
        jobs=1,
    )
    assert "puppets-1.1 tiny, sources captured" in repr(run)
    assert run.rows["value"].notna().any()
    assert run.problems.empty
