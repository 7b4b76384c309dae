"""Puppets as a data set: cases, cache, and the same motion everywhere."""

from __future__ import annotations

import json
import multiprocessing
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.api import SPLITS, CaseInfo
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.randomness import Stream
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion import bvh
from retarget_bench.motion.contact import CONTACT_ROLES
from retarget_bench.motion.roles import FEET, HANDS

SAMPLE = Path(__file__).with_name("puppets_sample.json")


def every(data: Puppets) -> list[CaseInfo]:
    return [info for split in SPLITS for info in data.cases("retarget", split)]


# --------------------------------------------------------------------------------------------- cases
@pytest.mark.parametrize(("size", "most"), [("tiny", 150), ("default", 2000)])
def test_cases_are_fixed_balanced_and_in_the_right_split(size: str, most: int) -> None:
    data, again = Puppets(size=size), Puppets(size=size)
    cast = data.characters()
    infos = every(data)
    assert [info.id for info in infos] == [info.id for info in every(again)]
    assert len({info.id for info in infos}) == len(infos) <= most
    for split in SPLITS:
        mine = data.cases("retarget", split)
        for side in ("source", "target"):
            count = Counter(getattr(info, side) for info in mine)
            assert set(count) == set(cast)
            assert max(count.values()) - min(count.values()) <= 2
        assert len(set(Counter(info.kind for info in mine).values())) == 1
        assert {info.kind for info in mine} == {"walk", "wave", "squat"}
        for info in mine:
            alike = cast[info.source].structure == cast[info.target].structure
            expected = "self" if info.source == info.target else "intra" if alike else "cross"
            assert (info.split, info.task) == (expected, "retarget")
            assert info.id == f"puppets/{info.source}>{info.target}/{info.clip}"


def test_tiny_clips_last_two_to_four_seconds() -> None:
    frames = {info.clip: info.frames for info in every(Puppets())}
    assert len(frames) == 15
    assert 60 <= min(frames.values()) < max(frames.values()) <= 120


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
        assert case.contacts.roles == CONTACT_ROLES == FEET
        assert case.contacts.planted.shape == (info.frames, 4)
        assert case.ground.height == 0.0


def test_self_cases_answer_themselves_and_others_do_not() -> None:
    data = Puppets()
    same = data.load(data.cases("retarget", "self")[3])
    assert np.array_equal(same.source.rotations, same.reference.rotations)
    other = data.load(data.cases("retarget", "intra")[0])
    assert np.abs(other.source.positions - other.reference.positions).max() > 0.05


def test_wrong_requests_are_refused_in_words() -> None:
    with pytest.raises(BenchError, match=r"size 'large'.*tiny, default"):
        Puppets(size="large")  # type: ignore[arg-type]
    data = Puppets()
    with pytest.raises(NotSupported, match="denoise"):
        data.cases("denoise", "cross")
    info = data.cases("retarget", "cross")[0]
    with pytest.raises(BenchError, match="no case"):
        data.load(CaseInfo("puppets/a>b/c", "retarget", "cross", info.source, info.target, "jump-01"))


def test_characters_are_understood_by_their_names_alone() -> None:
    for body in Puppets().characters().values():
        joints = body.joint_of
        assert {"hips", "neck", "head", *HANDS, *FEET} <= set(joints)
        assert len(body.skeleton) == int(body.structure.removeprefix("body"))
        if body.structure == "body28":
            assert {"head_top", "left_toe_end", "right_toe_end"} <= set(joints)


def test_reference_poses_are_t_poses_whatever_the_rest_pose() -> None:
    for body in Puppets().characters().values():
        still = body.motion(body.reference_pose[None], body.skeleton.offsets[:1], 30.0)
        place = {role: still.positions[0, joint] for role, joint in body.joint_of.items()}
        for side, out in (("left", 1.0), ("right", -1.0)):
            arm = place[f"{side}_hand"] - place[f"{side}_arm"]
            leg = place[f"{side}_foot"] - place[f"{side}_up_leg"]
            np.testing.assert_allclose(arm / np.linalg.norm(arm), [out, 0, 0], atol=1e-9)
            np.testing.assert_allclose(leg / np.linalg.norm(leg), [0, -1, 0], atol=1e-9)
            assert place[f"{side}_toe"][2] > place[f"{side}_foot"][2]


def test_rest_poses_differ() -> None:
    def arm_at_rest(name: str) -> np.ndarray:
        skeleton = Puppets().characters()[name].skeleton
        bone = skeleton.offsets[skeleton.index("LeftForeArm")]
        return bone / np.linalg.norm(bone)

    along_x = Puppets().characters()["boris"].skeleton
    np.testing.assert_allclose(along_x.offsets[along_x.index("LeftLeg")][1:], 0.0, atol=1e-12)
    np.testing.assert_allclose(arm_at_rest("ada"), [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(arm_at_rest("pip"), [0.5**0.5, -(0.5**0.5), 0], atol=1e-12)


# ------------------------------------------------------------------------------------ the same motion
def sample(data: Puppets) -> dict[str, list[list[float]]]:
    """Places of hips, hands and toes of every body in a few frames of a clip of every kind."""
    found = {}
    for info in data.cases("retarget", "self"):
        motion = data.load(info).reference
        joints = motion.character.joints(("hips", "head", *HANDS, "left_toe", "right_foot"))
        found[f"{info.target}/{info.clip}"] = (
            motion.positions[[0, 17, 43]][:, joints].reshape(3, -1).tolist()
        )
    return found


def test_the_motion_is_the_one_that_was_published() -> None:
    """A change here is a change of the corpus: move the generator's version, then this sample."""
    known = json.loads(SAMPLE.read_text())
    found = sample(Puppets())
    assert set(found) == set(known)
    for name, places in known.items():
        np.testing.assert_allclose(found[name], places, rtol=0, atol=1e-6, err_msg=name)


def test_random_bits_are_those_of_philox() -> None:
    """First output of Philox-4x64-10 for key and counter 0 .. as published with the Random123 library."""
    stream = Stream("a name")
    again, other = Stream("a name"), Stream("another name")
    values = [stream.uniform(0.0, 1.0) for _ in range(200)]
    assert values == [again.uniform(0.0, 1.0) for _ in range(200)]
    assert values[0] != other.uniform(0.0, 1.0)
    # Salmon et al., Random123 known-answer file, philox4x64 10 rounds, all zeros; NumPy counts before use
    bits = np.random.Philox(key=0, counter=[2**64 - 1] * 4).random_raw(4)
    expected = [0x16554D9ECA36314C, 0xDB20FE9D672D0FDC, 0xD7E772CEE186176B, 0x7E68B68AEC7BA23B]
    assert [int(each) for each in bits] == expected


def test_random_numbers_have_their_distributions() -> None:
    stream = Stream("distribution")
    units = np.array([stream.uniform(2.0, 4.0) for _ in range(4000)])
    normal = np.array([stream.normal(3.0) for _ in range(4000)])
    assert abs(units.mean() - 3.0) < 0.05
    assert abs(units.std() - 2.0 / 12**0.5) < 0.03
    assert abs(normal.mean()) < 0.2
    assert abs(normal.std() - 3.0) < 0.25
    assert Counter(stream.choice("abc") for _ in range(3000)).most_common()[-1][1] > 850


def test_no_last_digit_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Random numbers that differ by 1e-12 give motions that differ by less than 1e-8 m."""
    from retarget_bench.datasets.puppets.characters import BODIES
    from retarget_bench.datasets.puppets.clips import clips
    from retarget_bench.datasets.puppets.solver import solve

    def motions() -> list[np.ndarray]:
        found = []
        for clip in clips("tiny", 0):
            score = clip.score()
            for body in list(BODIES.values())[1::2]:
                solution = solve(score, body)
                found.append(body.place(solution.turned, solution.root))
        return found

    exact, draw = motions(), Stream._units
    monkeypatch.setattr(Stream, "_units", lambda self, n: [u * (1.0 - 1e-12) for u in draw(self, n)])
    for one, other in zip(exact, motions(), strict=True):
        assert 0.0 < np.abs(one - other).max() < 1e-8


def test_another_seed_is_another_corpus() -> None:
    first, second = Puppets(), Puppets(seed=1)
    assert first.content != second.content != Puppets(size="default").content
    info = first.cases("retarget", "self")[0]
    frames = {data.load(data.cases("retarget", "self")[0]).reference.frames for data in (first, second)}
    assert len(frames) == 2 or info.clip != second.cases("retarget", "self")[0].clip


# --------------------------------------------------------------------------------------------- cache
def cached(cache: Path) -> list[Path]:
    return sorted(cache.rglob("*.npz"))


def test_solved_clips_are_kept_and_read_back(cache: Path) -> None:
    info = Puppets().cases("retarget", "cross")[0]
    first = Puppets().load(info).reference
    (file,) = cached(cache)
    stamp = file.stat().st_mtime_ns
    second = Puppets().load(info).reference
    assert file.stat().st_mtime_ns == stamp
    assert np.array_equal(first.rotations, second.rotations)
    assert np.array_equal(first.root, second.root)


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "other"])
def test_a_damaged_cache_is_noticed_and_rebuilt(cache: Path, damage: str) -> None:
    info = Puppets().cases("retarget", "cross")[0]
    good = Puppets().load(info).reference
    (file,) = cached(cache)
    whole = file.read_bytes()
    if damage == "flip":
        place = len(whole) // 2
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
    elif damage == "other":
        np.savez(file, something=np.zeros(3))
    else:
        file.write_bytes(whole[: len(whole) // 3] if damage == "cut" else b"")
    assert np.array_equal(Puppets().load(info).reference.rotations, good.rotations)
    assert np.array_equal(Puppets().load(info).reference.root, good.root)
    with np.load(file) as archive:
        assert f"{info.target}.rotations" in archive


def test_a_cache_that_cannot_be_written_costs_nothing_but_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "file"))
    data = Puppets()
    assert data.load(data.cases("retarget", "self")[0]).reference.frames > 0


def _load_some(start: int) -> float:
    data = Puppets()
    infos = data.cases("retarget", "cross")[:12]
    return float(sum(data.load(infos[(start + k) % 12]).reference.rotations.sum() for k in range(12)))


def test_several_processes_build_at_once(cache: Path) -> None:
    with multiprocessing.get_context("spawn").Pool(3) as pool:
        totals = pool.map(_load_some, [0, 4, 8])
    np.testing.assert_allclose(totals, totals[0])
    assert len(cached(cache)) == len({i.clip for i in Puppets().cases("retarget", "cross")[:12]})
    assert not [path for path in cache.rglob(".*") if path.is_file()]


def test_building_the_data_set_reads_and_makes_nothing(cache: Path) -> None:
    code = (
        "from retarget_bench.datasets.puppets import plugin; import sys;"
        "d = plugin(); d.cases('retarget', 'intra'); d.notes;"
        "assert not {'torch', 'scipy', 'pandas', 'matplotlib'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env={**os.environ, "PYTHONPATH": "."})
    assert cached(cache) == []


# --------------------------------------------------------------------------------------------- files
def test_written_files_say_the_same(tmp_path: Path) -> None:
    data = Puppets()
    for number, info in enumerate(data.cases("retarget", "self")[::5]):
        motion = data.load(info).reference
        path = tmp_path / f"{number}.bvh"
        bvh.write(path, motion, scale=100.0)
        back = bvh.read(path, scale=0.01)
        assert back.skeleton.same_as(motion.skeleton)
        assert abs(back.fps - 30.0) < 1e-3
        again = motion.character.motion(back.rotations, back.root, back.fps)
        np.testing.assert_allclose(again.positions, motion.positions, rtol=0, atol=1e-6)
