"""The mixamo data set on small folders written on the spot."""

from __future__ import annotations

import hashlib
from collections import Counter

import numpy as np
import pytest

from retarget_bench.api import SPLITS
from retarget_bench.datasets.mixamo import Mixamo, protocols
from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion import bvh

A_B = {"Aj": ["Walk", "Wave"], "BigVegas": ["Walk", "Wave"], "Mousey_m": ["Walk", "Wave"]}
SAN = ("BigVegas", "Mousey_m", "Goblin_m", "Mremireh_m", "Vampire_m")


def every_case(dataset):
    return [info for split in SPLITS for info in dataset.cases("retarget", split)]


def note(dataset, word):
    return next(sentence for sentence in dataset.notes if word in sentence)


# ------------------------------------------------------------------------------------------ cases
def test_all_ordered_pairs_by_the_structure_of_the_native_rig(mini):
    root = mini(A_B)
    for structure in ("native", "full", "body22"):
        dataset = Mixamo(str(root), structure=structure)
        pairs = {split: {info.pair for info in dataset.cases("retarget", split)} for split in SPLITS}
        assert pairs["self"] == {"Aj>Aj", "BigVegas>BigVegas", "Mousey_m>Mousey_m"}
        assert pairs["intra"] == {"Aj>BigVegas", "BigVegas>Aj"}
        assert pairs["cross"] == {"Aj>Mousey_m", "Mousey_m>Aj", "BigVegas>Mousey_m", "Mousey_m>BigVegas"}
        assert len(every_case(dataset)) == 9 * 2
        assert not dataset.notes


def test_cases_have_stable_ids_lengths_and_order(mini):
    dataset = Mixamo(str(mini(A_B, frames=21)))
    infos = dataset.cases("retarget", "cross")
    assert infos[0].id == "mixamo/Aj>Mousey_m/Walk"
    assert {info.frames for info in infos} == {11}
    assert [info.clip for info in infos] == ["Walk"] * 4 + ["Wave"] * 4
    assert list(Mixamo(str(mini({}))).cases("retarget", "cross")) == list(infos)
    assert not dataset.cases("denoise", "cross")


def test_structures_of_the_papers_by_rig(mini):
    root = str(mini(A_B))
    native = Mixamo(root).characters()
    assert {name: len(body.skeleton) for name, body in native.items()} == {
        "Aj": 23,
        "BigVegas": 23,
        "Mousey_m": 28,
    }
    assert {len(body.skeleton) for body in Mixamo(root, structure="body22").characters().values()} == {22}
    assert len(Mixamo(root, structure="full").characters()["Aj"].skeleton) == 26


def test_a_plain_rig_is_another_structure_and_is_reduced_to_the_body(mini, tmp_path, rigs):
    root = mini({"Aj": ["Walk"], "Mousey_m": ["Walk"]})
    for size, name in ((1.0, "Xbot"), (1.1, "Ybot")):
        rigs.plain(root / name / "Walk.bvh", size=size)
    dataset = Mixamo(str(root))
    assert {info.pair for info in dataset.cases("retarget", "intra")} == {"Xbot>Ybot", "Ybot>Xbot"}
    assert len(dataset.characters()["Xbot"].skeleton) == 22


# ---------------------------------------------------------------------------------------- motions
def test_sixty_frames_become_thirty_by_every_second_frame(mini):
    root = str(mini(A_B, frames=21))
    full, half = (Mixamo(root, fps=fps, structure="full") for fps in (60.0, 30.0))
    one, two = full.motion("Aj", "Walk"), half.motion("Aj", "Walk")
    assert (one.fps, two.fps, one.frames, two.frames) == (60.0, 30.0, 21, 11)
    np.testing.assert_array_equal(two.rotations, one.rotations[::2])
    np.testing.assert_array_equal(two.root, one.root[::2])


def test_motions_are_metres_and_keep_the_places_of_the_kept_joints(mini):
    root = mini(A_B)
    file = bvh.read(root / "Mousey_m" / "Walk.bvh", root="absolute")
    native = Mixamo(str(root), fps=60.0, structure="full").motion("Mousey_m", "Walk")
    np.testing.assert_allclose(native.root * 100.0, file.root, atol=1e-6)
    for structure in ("native", "body22"):
        motion = Mixamo(str(root), fps=60.0, structure=structure).motion("Mousey_m", "Walk")
        joints = [native.skeleton.index(name) for name in motion.skeleton.names]
        np.testing.assert_allclose(motion.positions, native.positions[:, joints], atol=1e-9)


def test_memory_for_motions_is_bounded(mini, monkeypatch):
    from retarget_bench.datasets.mixamo import motions

    dataset = Mixamo(str(mini(A_B)))
    monkeypatch.setattr(motions, "CACHED", 1)
    first = dataset.motion("Aj", "Walk")
    assert dataset.motion("Aj", "Walk") is first
    dataset.motion("Aj", "Wave")
    assert dataset.motion("Aj", "Walk") is not first
    np.testing.assert_array_equal(dataset.motion("Aj", "Walk").rotations, first.rotations)


# ------------------------------------------------------------------------------------ incomplete data
def test_unequal_lengths_drop_the_pairs_and_are_counted(mini):
    root = mini(A_B, frames=20)
    mini({"Mousey_m": ["Wave"]}, frames=40)
    dataset = Mixamo(str(root))
    assert {info.pair for info in every_case(dataset) if info.clip == "Wave"} == {
        "Aj>Aj",
        "BigVegas>BigVegas",
        "Mousey_m>Mousey_m",
        "Aj>BigVegas",
        "BigVegas>Aj",
    }
    text = note(dataset, "unequal")
    assert text.startswith("4 ordered pairs in 1 clip left out")
    assert "Aj 10, BigVegas 10, Mousey_m 20 frames" in text


def test_missing_clips_are_counted(mini):
    dataset = Mixamo(str(mini({**A_B, "Mousey_m": ["Walk"]})))
    assert Counter(info.clip for info in every_case(dataset)) == {"Walk": 9, "Wave": 4}
    assert note(dataset, "on one side").startswith("5 ordered pairs in 1 clip")


@pytest.mark.parametrize("damage", [b"version https://git-lfs.github.com/spec/v1\n", b"", None])
def test_files_that_cannot_be_read_are_named_and_left_out(mini, damage):
    root = mini(A_B)
    path = root / "Aj" / "Wave.bvh"
    path.write_bytes(path.read_bytes()[:-100] if damage is None else damage)
    dataset = Mixamo(str(root))
    assert len(every_case(dataset)) == 9 + 4
    assert "Aj/Wave.bvh (" in note(dataset, "cannot be used")
    with pytest.raises(FileError, match=r"Aj/Wave\.bvh"):
        dataset.motion("Aj", "Wave")


def test_files_in_metres_are_noticed(mini, rigs):
    root = mini({"Aj": ["Walk"]})
    rigs.plain(root / "Xbot" / "Walk.bvh", size=0.01)
    dataset = Mixamo(str(root))
    assert {info.pair for info in every_case(dataset)} == {"Aj>Aj"}
    assert "give unit=m" in note(dataset, "cannot be used")


def test_a_folder_with_two_rigs_counts_each_clip_with_its_own(mini, rigs):
    root = mini({"Aj": ["Walk", "Wave"], "Mousey_m": ["Walk", "Wave"]})
    rigs.plain(root / "Mousey_m" / "Wave.bvh", size=0.6)
    dataset = Mixamo(str(root))
    assert "holds rigs of 2 structures" in note(dataset, "Mousey_m")
    case = next(info for info in dataset.cases("retarget", "cross") if info.clip == "Wave")
    assert {len(dataset.load(case).source.skeleton), len(dataset.load(case).target.skeleton)} == {22, 23}


# ------------------------------------------------------------------------------------ wrong folders
def test_wrong_roots_say_what_to_give(mini, tmp_path):
    root = mini(A_B)
    (tmp_path / "empty").mkdir()
    (tmp_path / "fbx" / "Aj").mkdir(parents=True)
    (tmp_path / "fbx" / "Aj" / "Walk.fbx").touch()
    for path, message in {
        "": "--root DIR",
        str(tmp_path / "nowhere"): "there is no folder",
        str(root / "Aj"): f"--root {root.resolve()}",
        str(tmp_path): f"--root {root}",
        str(root / "Aj" / "Walk.bvh"): "is a file",
        str(tmp_path / "empty"): "it holds nothing",
        str(tmp_path / "fbx"): r"\.fbx files, and only BVH is read",
    }.items():
        with pytest.raises(BenchError, match=message):
            Mixamo(path).cases("retarget", "self")


def test_the_folders_of_the_archive_that_are_no_characters_do_not_count(mini):
    root = mini({"Aj": ["Walk"]})
    (root / "std_bvhs").mkdir()
    (root / "std_bvhs" / "Aj.bvh").write_bytes((root / "Aj" / "Walk.bvh").read_bytes())
    assert {info.source for info in every_case(Mixamo(str(root)))} == {"Aj"}


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"fps": 0.0}, "not a frame rate"),
        ({"protocol": "folds", "fold": 5}, "folds are 0 to 4"),
        ({"protocol": "san", "fps": 60.0}, "protocol=san means fps=30"),
        ({"protocol": "san", "structure": "body22"}, "protocol=san means fps=30"),
        ({"part": "validation"}, "protocol=all tests every clip and leaves none to train on"),
    ],
)
def test_parameters_that_make_no_sense(parameters, message):
    with pytest.raises(BenchError, match=message):
        Mixamo("anywhere", **parameters)


# ---------------------------------------------------------------------------------------------- san
def test_san_asks_for_its_pairs_and_calls_part_of_them_partial(mini):
    root = mini({name: ["Walk", "Wave"] for name in ("Aj", *SAN[:3])}, frames=30)
    dataset = Mixamo(str(root), protocol="san")
    pairs = {split: {info.pair for info in dataset.cases("retarget", split)} for split in SPLITS}
    assert pairs["cross"] == {"BigVegas>Mousey_m", "BigVegas>Goblin_m"}
    assert pairs["intra"] == {"Mousey_m>Goblin_m", "Goblin_m>Mousey_m"}
    assert pairs["self"] == {"Mousey_m>Mousey_m", "Goblin_m>Goblin_m"}
    assert dataset.label == "mixamo san-partial (2 of 106 clips, 6 of 20 pairs)"
    text = note(dataset, "not the papers' test set")
    assert "12 of its 2120 cases, with 2 of 106 clips and 2 of 4 target characters" in text
    assert {info.frames for info in every_case(dataset)} == {12}
    case = dataset.load(dataset.cases("retarget", "cross")[0])
    assert case.source.frames == case.reference.frames == 12


def test_san_follows_the_test_list(mini):
    root = mini({name: ["Walk", "Wave", "Run"] for name in SAN})
    (root / "test_list.txt").write_text("Wave.bvh\r\nWalk.bvh\r\nSit (1).bvh\r\n")
    dataset = Mixamo(str(root), protocol="san")
    assert {info.clip for info in every_case(dataset)} == {"Walk", "Wave"}
    ((structure, cast),) = dataset.training().items()
    assert {name: clips.names for name, clips in cast.items()} == {"BigVegas": ("Run",)}
    assert cast["BigVegas"][0].character.structure == structure
    assert dataset.motion("BigVegas", "Run").frames == 8
    with pytest.raises(BenchError, match=r"holds no BigVegas/Fly\.bvh"):
        dataset.motion("BigVegas", "Fly")
    assert dataset.held_out == tuple(sorted(SAN[1:]))


def test_the_whole_of_san_is_not_called_partial(mini, monkeypatch):
    clips = [f"Clip {n}" for n in range(3)]
    root = mini(dict.fromkeys(SAN, clips), frames=8)
    (root / "test_list.txt").write_text("".join(f"{clip}.bvh\n" for clip in clips))
    monkeypatch.setattr(protocols, "SAN_CLIPS", 3)
    dataset = Mixamo(str(root), protocol="san")
    assert dataset.label == "mixamo san (3 clips, 20 pairs)"
    assert not dataset.notes
    sizes = {split: len(dataset.cases("retarget", split)) for split in SPLITS}
    assert sizes == {"self": 4 * 3, "intra": 12 * 3, "cross": 4 * 3}
    (root / "Goblin_m" / "Clip 1.bvh").unlink()
    assert "san-partial (3 of 3 clips, 20 of 20 pairs)" in Mixamo(str(root), protocol="san").label


def test_san_takes_no_other_rig_for_its_characters(mini, rigs):
    root = mini({name: ["Walk"] for name in SAN[:3]})
    rigs.plain(root / "Vampire" / "Walk.bvh")
    dataset = Mixamo(str(root), protocol="san")
    assert "Vampire" not in {info.target for info in every_case(dataset)}
    assert "Vampire/Walk.bvh" in note(dataset, "another rig")


# -------------------------------------------------------------------------------------------- folds
def test_folds_part_the_clips_whatever_else_is_there(mini):
    names = [f"Clip {letter}" for letter in "abcdefghij"]
    root = mini({"Aj": names, "Mousey_m": names}, frames=6)
    before = [{info.clip for info in every_case(fold(root, n))} for n in range(protocols.FOLDS)]
    assert sorted(clip for clips in before for clip in clips) == names
    mini({"Aj": ["Clip x", "A new one"], "BigVegas": names}, frames=6)
    after = [{info.clip for info in every_case(fold(root, n))} for n in range(protocols.FOLDS)]
    assert all(old <= new for old, new in zip(before, after, strict=True))


def test_what_a_fold_trains_on_is_in_no_case_of_it(mini):
    names = [f"Clip {letter}" for letter in "abcdefghij"]
    root = mini({"Aj": names, "BigVegas": names, "Mousey_m": names}, frames=6)
    for number in range(protocols.FOLDS):
        dataset = fold(root, number)
        shown = {info.clip for info in every_case(dataset)}
        steering = {info.clip for info in every_case(dataset.validation())}
        trained = {name: clips for cast in dataset.training().values() for name, clips in cast.items()}
        learned = {clip for clips in trained.values() for clip in clips.names}
        assert sorted([*shown, *steering, *learned]) == names
        assert not set(dataset.held_out) & set(trained)
        for info in every_case(dataset.validation()):
            assert {info.source, info.target} <= set(trained)
        manifest = dataset.training_manifest()
        assert set(manifest["characters"]) == set(trained)
        assert set(manifest["clips"]) == learned | steering
        assert dataset.validation().label == f"mixamo fold {number} of 5, validation"
        assert "papers' own test clips" in dataset.card.summary
        assert dataset.label == f"mixamo fold {number} of 5"
    assert "folds" not in Mixamo.card.summary


def test_san_is_steered_by_a_fifth_of_what_it_may_train_on(mini):
    names = [f"Clip {letter}" for letter in "abcdefghijkl"]
    root = mini(dict.fromkeys(("Aj", *SAN), names), frames=10)
    (root / "test_list.txt").write_text("Clip a.bvh\nClip b.bvh\n")
    dataset = Mixamo(str(root), protocol="san")
    steering = every_case(dataset.validation())
    trained = {name: clips for cast in dataset.training().values() for name, clips in cast.items()}
    assert {info.clip for info in steering} == {name for name in names[2:] if protocols.fold_of(name) == 0}
    assert set(trained) == {name for info in steering for name in (info.source, info.target)}
    assert not set(trained) & set(SAN[1:])
    for clips in trained.values():
        assert sorted({*clips.names, *(info.clip for info in steering)}) == names[2:]
        assert not set(clips.names) & {info.clip for info in steering}
    assert dataset.validation().content != dataset.content
    assert Mixamo(str(root)).training() == {}


def test_training_clips_are_read_when_asked_and_only_what_is_readable_is_listed(mini, rigs):
    """Of a folder with two rigs, the structure of most of its clips."""
    names = [f"Clip {letter}" for letter in "abcdefghij"]
    root = mini({"Aj": names, "BigVegas": names}, frames=6)
    dataset = fold(root, 0)
    one, other, *_ = dataset.training()["mixamo-A"]["Aj"].names
    (root / "Aj" / f"{one}.bvh").write_bytes(b"")
    rigs.plain(root / "Aj" / f"{other}.bvh", size=0.6)
    training = fold(root, 0).training()
    left = set(names) - {one, other}
    assert list(training) == ["mixamo-A"]
    assert set(training["mixamo-A"]["Aj"].names) <= left
    assert len(training["mixamo-A"]["BigVegas"]) == len(training["mixamo-A"]["Aj"]) + 2
    clips = training["mixamo-A"]["Aj"]
    assert [motion.frames for motion in clips[1:]] == [motion.frames for motion in clips][1:]
    last = dataset.motion("Aj", clips.names[-1])
    assert np.array_equal(clips[-1].rotations, last.rotations)


def test_folds_are_pinned():
    """Whoever trained on a fold must find the same one in every later version."""
    held = {name: protocols.fold_of(name) for name in ("Aj", "BigVegas", "Goblin_m", "Kaya", "Mousey_m")}
    assert held == {"Aj": 3, "BigVegas": 1, "Goblin_m": 0, "Kaya": 2, "Mousey_m": 4}
    expected = int(hashlib.sha256(b"mixamo-folds-191:Idle").hexdigest(), 16) % 5
    assert protocols.fold_of("Idle") == protocols.fold_of("Idle (1)") == expected


def fold(root, number):
    return Mixamo(str(root), protocol="folds", fold=number)


# ----------------------------------------------------------------------------------------- identity
def test_content_follows_the_bytes_and_the_parameters_and_not_the_place(mini, tmp_path):
    root = mini(A_B)
    first = Mixamo(str(root)).content
    moved = root.rename(tmp_path / "moved")
    assert Mixamo(str(moved)).content == first
    assert Mixamo(str(moved), fps=60.0).content != first
    assert Mixamo(str(moved), structure="body22").content != first
    path = moved / "Aj" / "Walk.bvh"
    path.write_bytes(path.read_bytes() + b"\n")
    assert Mixamo(str(moved)).content != first


def test_label_says_what_is_not_as_by_default(mini):
    root = str(mini({"Aj": ["Walk"]}))
    assert Mixamo(root).label == "mixamo"
    assert Mixamo(root, fps=60.0, structure="body22").label == "mixamo (60 fps, body22)"


def test_training_pairs_are_clips_that_two_characters_perform_alike(mini):
    names = [f"Clip {letter}" for letter in "abcdefghij"]
    root = mini(dict.fromkeys(("Aj", "BigVegas", "Mousey_m"), names), frames=6)
    dataset = fold(root, 0)
    alone, uneven, *_ = sorted(
        {clip for cast in dataset.training()["mixamo-A"].values() for clip in cast.names}
    )
    free = sorted({name for cast in dataset.training().values() for name in cast})
    for name in free[1:]:
        (root / name / f"{alone}.bvh").unlink()
    mini({free[-1]: [uneven]}, frames=9)
    pairs = fold(root, 0).training_pairs()
    trained = {
        (pair.clip, pair.source.motion.character.name, pair.target.motion.character.name) for pair in pairs
    }
    shown = {info.clip for part in (dataset, dataset.validation()) for info in every_case(part)}
    expected = {
        (clip, one, other)
        for clip in set(names) - shown - {alone}
        for one in free
        for other in free
        if one != other and (clip != uneven or free[-1] not in (one, other))
    }
    assert trained == expected
    for pair in pairs:
        assert pair.source.motion.frames == pair.target.motion.frames
        assert not pair.exact
        assert pair.source.contacts is None
    assert Mixamo(str(root)).training_pairs() is None
