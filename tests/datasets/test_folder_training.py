"""What a folder leaves to train on: its protocols, and files that hold no motion of a whole body."""

from __future__ import annotations

import math
import shutil

import numpy as np
import pytest

from retarget_bench.api import SPLITS
from retarget_bench.datasets.folder import Folder, part_of, unusable
from retarget_bench.errors import BenchError, NotSupported, Unusable
from retarget_bench.motion import bvh
from retarget_bench.motion.character import Character
from retarget_bench.motion.completion import poses
from retarget_bench.training.clips import training_clips
from tests.datasets.conftest import skeleton, structure_a

CLIPS = [f"take {number}" for number in range(25)]


def clips_of(data):
    """Of all cases."""
    return {info.clip for split in SPLITS for info in data.cases("retarget", split)}


def trained(data):
    return {name: set(clips.names) for cast in data.training().values() for name, clips in cast.items()}


@pytest.fixture
def two(mini):
    """Two bodies of one structure, with many clips of the same names, and a third of another."""
    cast = {"Aj": CLIPS, "BigVegas": CLIPS[:20], "Mousey_m": CLIPS[5:]}
    root = mini({name: clips[:1] for name, clips in cast.items()}, frames=4)
    for name, (first, *others) in cast.items():
        for clip in others:
            shutil.copy(root / name / f"{first}.bvh", root / name / f"{clip}.bvh")
    return root


def test_a_name_decides_by_itself_and_the_shares_are_a_fifth_and_a_tenth():
    names = [f"{who}_{take:02}" for who in range(100) for take in range(40)]
    parts = [part_of(name, "split") for name in names]
    for part, share in (("test", 0.2), ("validation", 0.1), ("train", 0.7)):
        spread = 4.0 * math.sqrt(len(names) * share * (1.0 - share))
        assert abs(parts.count(part) - share * len(names)) < spread
    assert {part_of(name, "all") for name in names} == {"test"}
    assert {part_of(name, "train") for name in names} == {"train"}


def test_split_parts_the_clips_and_those_of_one_name_stay_together(two):
    data = Folder(str(two), protocol="split")
    tested, aside = clips_of(data), clips_of(data.validation())
    moving = trained(data)
    assert set(moving) == {"Aj", "BigVegas", "Mousey_m"}
    learnt = set.union(*moving.values())
    assert tested
    assert aside
    assert tested | aside | learnt == set(CLIPS)
    assert not tested & aside
    assert not (tested | aside) & learnt
    assert moving["BigVegas"] == learnt & set(CLIPS[:20])
    assert clips_of(Folder(str(two))) == set(CLIPS)
    paired = next(info for info in data.cases("retarget", "intra") if info.clip in CLIPS[:20])
    assert data.load(paired).reference is not None


def test_split_is_known_by_its_part(two):
    data = Folder(str(two), protocol="split")
    aside = data.validation()
    labels = [each.label for each in (Folder(str(two)), data, aside, Folder(str(two), protocol="train"))]
    assert labels == [
        "folder mini",
        "folder mini, split",
        "folder mini, split, validation",
        "folder mini, train",
    ]
    contents = {
        each.content for each in (Folder(str(two)), data, aside, Folder(str(two), protocol="train"))
    }
    assert len(contents) == 4
    assert aside.training_manifest() == data.training_manifest()
    assert aside.validation().content == aside.content


def test_train_keeps_every_clip_and_has_no_case(two):
    data = Folder(str(two), protocol="train")
    assert not clips_of(data)
    assert data.validation() is None
    assert trained(data) == {"Aj": set(CLIPS), "BigVegas": set(CLIPS[:20]), "Mousey_m": set(CLIPS[5:])}
    assert data.notes == ("every clip is trained on (protocol=train), and none is a case",)
    assert not data.training_notes
    cast = data.characters()
    for structure, bodies in data.training().items():
        assert {cast[name].structure for name in bodies} == {structure}
    assert len(data.training()) == 2


def test_what_is_trained_on_is_the_motion_of_the_files(two):
    clips = Folder(str(two), protocol="train", fps=0.0).training()
    (motions,) = (each["Mousey_m"] for each in clips.values() if "Mousey_m" in each)
    number = motions.names.index("take 7")
    expected = bvh.read(two / "Mousey_m" / "take 7.bvh", root="absolute", scale=0.01)
    np.testing.assert_allclose(motions[number].root, expected.root, atol=1e-9)
    assert motions[number].character.name == "Mousey_m"
    assert [motion.frames for motion in motions[2:4]] == [4, 4]


def test_a_folder_that_is_all_cases_says_how_to_train_on_it(two):
    assert Folder(str(two)).training() == {}
    assert Folder(str(two)).validation() is None
    with pytest.raises(NotSupported, match=r"folder mini has no training motion; every clip is a case: "):
        training_clips(Folder(str(two)))


@pytest.mark.parametrize("clip", ["take 0", "take 1", "take 2", "take 3", "take 4", "take 5", "take 6"])
def test_one_clip_cannot_be_split_and_it_is_said(mini, clip):
    data = Folder(str(mini({"Aj": [clip]}, frames=4)), protocol="split")
    part = part_of(clip, "split")
    if part == "train":
        assert trained(data) == {"Aj": {clip}}
    else:
        with pytest.raises(
            NotSupported, match=r"keeps none of 1 clip to train on: protocol=train trains on all"
        ):
            training_clips(data)
    sentence = "protocol=split keeps none of 1 clip for test"
    assert (sentence in data.notes) == (part != "test")
    assert (data.validation() is None) == (part != "validation")


def test_a_part_is_of_split_alone(two):
    with pytest.raises(BenchError, match="part=validation means something with protocol=split alone"):
        Folder(str(two), part="validation")


def motion(root=(0.0, 0.0, 0.0), turn=0.5, frames=12):
    """A body whose root goes so many metres along each axis and back, and whose limbs turn."""
    body = Character.of("mini", skeleton(structure_a()))
    wave = np.sin(np.linspace(0.0, np.pi, frames))
    rotations = np.tile(np.array([1.0, 0.0, 0.0, 0.0]), (frames, len(body.skeleton), 1))
    joint = body.joint_of["left_arm"]
    rotations[:, joint, 0], rotations[:, joint, 3] = np.cos(turn * wave / 2), np.sin(turn * wave / 2)
    return body.motion(rotations, body.skeleton.offsets[0] + wave[:, None] * np.array(root), 30.0)


@pytest.mark.parametrize(
    ("clip", "says"),
    [
        (motion((0.0, 0.01, 0.5)), ""),
        (motion((0.0, 0.01, 0.0), turn=0.0), ""),
        (motion((0.3, 0.0, 2.0)), "its hips never change their height"),
        (motion(), "its hips never change their height"),
        (motion(turn=0.0), "nothing moves in it"),
    ],
)
def test_a_path_without_height_and_a_pose_are_no_motion(clip, says):
    assert unusable(clip) == says


def test_such_a_file_is_refused_when_it_is_its_turn(two):
    bvh.write(two / "Aj" / "flat.bvh", motion((0.3, 0.0, 2.0)), scale=100.0)
    motions = next(
        each["Aj"] for each in Folder(str(two), protocol="train").training().values() if "Aj" in each
    )
    number = motions.names.index("flat")
    with pytest.raises(Unusable, match=r"^flat: its hips never change their height$"):
        motions[number]
    assert motions[number + 1].frames == 2


def test_methods_that_learn_from_training_poses_go_without_it(two):
    """They find what they find without the file, which comes first; with nothing else they say so."""
    cast = Folder(str(two), protocol="train").training()
    target = next(each["Aj"] for each in cast.values() if "Aj" in each)[0].character
    without = poses(cast, target, 50)
    bvh.write(two / "Aj" / "flat.bvh", motion((0.3, 0.0, 2.0)), scale=100.0)
    more = Folder(str(two), protocol="train").training()
    assert poses(more, target, 50).tolist() == without.tolist()
    flat = {name: {"Aj": bodies["Aj"][:1]} for name, bodies in more.items() if "Aj" in bodies}
    assert next(iter(flat.values()))["Aj"].names == ("flat",)
    with pytest.raises(NotSupported, match="no motion to train on"):
        poses(flat, target, 50)
