"""The folder data set: loose files, bodies in folders, pairs by name, one target."""

from __future__ import annotations

import unicodedata

import numpy as np
import pytest

import retarget_bench as rb
from retarget_bench.api import SPLITS
from retarget_bench.datasets.folder import Folder
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import clips
from retarget_bench.motion import importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.gltf import write_into
from retarget_bench.motion.files.gltf import writing as gltf
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.files.smpl import skeletons
from retarget_bench.motion.files.smpl.skeletons import BODY
from retarget_bench.motion.skeleton import Skeleton
from tests.motion import smpl_files
from tests.motion.gltf_files import person

_BONES = {
    "lhipjoint": ("root", "1 -1 0", 2),
    "rhipjoint": ("root", "-1 -1 0", 2),
    "lowerback": ("root", "0 1 0", 2),
    **{f"{s}femur": (f"{s}hipjoint", "0 -1 0", 7) for s in "lr"},
    **{f"{s}tibia": (f"{s}femur", "0 -1 0", 7) for s in "lr"},
    **{f"{s}foot": (f"{s}tibia", "0 0 1", 2) for s in "lr"},
    "thorax": ("lowerback", "0 1 0", 4),
    "lowerneck": ("thorax", "0 1 0", 2),
    "head": ("lowerneck", "0 1 0", 2),
    **{f"{s}clavicle": ("thorax", f"{x} 0 0", 3) for s, x in (("l", 1), ("r", -1))},
    **{f"{s}humerus": (f"{s}clavicle", f"{x} 0 0", 5) for s, x in (("l", 1), ("r", -1))},
    **{f"{s}radius": (f"{s}humerus", f"{x} 0 0", 4) for s, x in (("l", 1), ("r", -1))},
    **{f"{s}wrist": (f"{s}radius", f"{x} 0 0", 2) for s, x in (("l", 1), ("r", -1))},
}
ASF = ":units\nlength 0.45\n:root\norder TX TY TZ RX RY RZ\n:bonedata\n" + "".join(
    f"begin\nname {name}\ndirection {way}\nlength {size}\ndof rx ry rz\nend\n"
    for name, (_, way, size) in _BONES.items()
)
ASF += (
    ":hierarchy\nbegin\n" + "".join(f"{above} {name}\n" for name, (above, *_) in _BONES.items()) + "end\n"
)


def every_case(dataset):
    return [info for split in SPLITS for info in dataset.cases("retarget", split)]


def pairs(dataset, split):
    return {(info.pair, info.clip) for info in dataset.cases("retarget", split)}


@pytest.fixture
def loose(mini, rigs):
    """Two files of one body and one of another, side by side."""
    root = mini({})
    root.mkdir()
    rigs.a(root / "walk.bvh")
    rigs.a(root / "wave.bvh")
    rigs.plain(root / "xbot.bvh", size=1.3)
    return root


def test_loose_files_with_the_same_bones_are_one_body(loose):
    dataset = Folder(str(loose))
    assert set(dataset.characters()) == {"walk", "xbot"}
    assert pairs(dataset, "self") == {("walk>walk", "walk"), ("walk>walk", "wave"), ("xbot>xbot", "xbot")}
    assert pairs(dataset, "cross") == {
        ("walk>xbot", "walk"),
        ("walk>xbot", "wave"),
        ("xbot>walk", "xbot"),
    }
    assert pairs(dataset, "intra") == set()
    assert dataset.label == f"folder {loose.name}"


def test_rounding_and_the_place_of_the_root_make_no_other_body(loose):
    text = (loose / "walk.bvh").read_text()
    other = text.replace("OFFSET 0.000000 98.000000 0.000000", "OFFSET 7.5 0.0 -412.0").replace(
        "28.0", "28.0002"
    )
    assert (other.count("28.0002"), other.count("-412.0")) == (2, 1)
    (loose / "rounded.bvh").write_text(other)
    (loose / "longer.bvh").write_text(text.replace("OFFSET 28.0", "OFFSET 29.0"))
    dataset = Folder(str(loose))
    assert set(dataset.characters()) == {"longer", "rounded", "xbot"}
    bodies = {dataset.load(info).target for info in every_case(dataset) if info.target == "rounded"}
    assert bodies == {dataset.characters()["rounded"]}


def test_a_body_that_cannot_be_used_is_named_and_left_out(loose):
    (loose / "puppet.bvh").write_text(
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 90 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT Spine\n{\n"
        "OFFSET 0 10 0\nCHANNELS 3 Xposition Yposition Yrotation\n}\nJOINT Leg\n{\n"
        "OFFSET 0 -40 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n}\n}\n"
        "MOTION\nFrames: 2\nFrame Time: 0.05\n0 0 0 0 10 0 0 0 0\n0 0 0 0 20 0 0 0 0\n"
    )
    dataset = Folder(str(loose))
    assert set(dataset.characters()) == {"walk", "xbot"}
    assert any(note.startswith("1 body cannot be used: puppet (") for note in dataset.notes)
    alone = Folder(str(loose), target=str(loose / "puppet.bvh"))
    with pytest.raises(BenchError, match="can be used: puppet"):
        alone.cases("retarget", "cross")


def test_unpaired_files_have_no_reference_but_the_body_itself(loose):
    dataset = Folder(str(loose))
    for info in every_case(dataset):
        case = dataset.load(info)
        assert case.source.character.name == info.source
        assert case.target is dataset.characters()[info.target]
        assert case.source.frames == info.frames
        assert (case.reference is None) == (info.split == "cross")
        assert info.split == "cross" or case.reference is case.source
    assert "3 of 6 cases have no reference" in dataset.notes[0]


def test_clips_of_one_name_and_length_are_pairs(mini, rigs):
    root = mini({"Aj": ["Walk", "Wave", "Jump"], "BigVegas": ["Walk", "Wave"]}, frames=20)
    mini({"BigVegas": ["Wave"]}, frames=30)
    dataset = Folder(str(root))
    paired = {
        info.clip: dataset.load(info).reference is not None
        for info in dataset.cases("retarget", "intra")
        if info.pair == "Aj>BigVegas"
    }
    assert paired == {"Walk": True, "Wave": False, "Jump": False}
    assert any("unequal length: Wave" in note for note in dataset.notes)
    walk = next(info for info in dataset.cases("retarget", "intra") if info.clip == "Walk")
    case = dataset.load(walk)
    assert case.reference.character is case.target
    assert case.reference.frames == case.source.frames == walk.frames == 10
    unpaired = Folder(str(root), pairs="none")
    assert all(unpaired.load(info).reference is None for info in unpaired.cases("retarget", "intra"))


def test_a_target_file_outside_is_the_only_target(loose, rigs, tmp_path):
    rigs.plain(tmp_path / "elsewhere" / "hero.bvh", size=0.7)
    dataset = Folder(str(loose), target=str(tmp_path / "elsewhere" / "hero.bvh"))
    assert {info.pair for info in every_case(dataset)} == {"walk>hero", "xbot>hero"}
    assert not dataset.cases("retarget", "self")
    assert dataset.label == f"folder {loose.name} to hero"
    assert dataset.load(dataset.cases("retarget", "cross")[0]).reference is None


def test_a_target_folder_gives_references_by_name(mini, tmp_path):
    root = mini({"Aj": ["Walk", "Wave"]}, folder="sources")
    mini({"BigVegas": ["Walk"]}, folder="targets")
    dataset = Folder(str(root), target=str(tmp_path / "targets" / "BigVegas"))
    infos = dataset.cases("retarget", "intra")
    assert [(info.pair, info.clip) for info in infos] == [("Aj>BigVegas", "Walk"), ("Aj>BigVegas", "Wave")]
    assert [dataset.load(info).reference is None for info in infos] == [False, True]


def test_a_target_among_the_sources_is_that_body(loose):
    dataset = Folder(str(loose), target=str(loose / "xbot.bvh"))
    assert {info.pair for info in every_case(dataset)} == {"walk>xbot", "xbot>xbot"}


def test_files_that_cannot_be_read_are_told_by_the_table_and_the_results(mini, rigs, tmp_path):
    root = mini({})
    rigs.plain(root / "ada/walk.bvh")
    rigs.plain(root / "ada/run.bvh")
    (root / "ada/cut.bvh").write_text((root / "ada/walk.bvh").read_text()[:-40])
    (root / "ada/empty.bvh").write_text("")
    data = Folder(str(root))
    assert data.unreadable.files == 4
    assert list(data.unreadable.problems) == ["ada/cut.bvh", "ada/empty.bvh"]
    results = rb.run(
        ["copy_rotations"], dataset=f"folder[root={root}]", metrics="position", out=tmp_path / "o"
    )
    (line,) = (each for each in str(results.table()).splitlines() if "cannot be read" in each)
    assert line.startswith("- 2 of 4 files cannot be read: ada/cut.bvh (line ")
    assert str(results.table()).count("cannot be read") == 1
    problems = results.problems
    assert problems[["case", "status"]].to_numpy().tolist() == [
        ["ada/cut.bvh", "unreadable"],
        ["ada/empty.bvh", "unreadable"],
    ]
    assert problems["message"][1] == "is empty"


def test_names_are_compared_in_their_composed_form(mini, rigs):
    """Archives of a Mac have names decomposed."""
    root = mini({})
    for folder, form in (("Zoë", "NFC"), ("B", "NFD")):
        rigs.plain(root / folder / unicodedata.normalize(form, "café.bvh"), size=1.0 + (form == "NFD"))
    assert pairs(Folder(str(root)), "intra") == {("Zoë>B", "café"), ("B>Zoë", "café")}
    decomposed = unicodedata.normalize("NFD", "caf?")
    infos = every_case(Folder(str(root)))
    assert clips.chosen(infos, [decomposed], 0) == infos


def test_folders_of_one_actors_styles_are_one_body(mini, rigs):
    root = mini({})
    rigs.plain(root / "angry/angry_walk.bvh")
    rigs.plain(root / "angry/run.bvh", frames=30)
    rigs.plain(root / "happy/happy_walk.bvh")
    rigs.plain(root / "happy/run.bvh", frames=34)
    rigs.plain(root / "other/odd.bvh", size=1.3)
    rigs.plain(root / "twin/run.bvh", frames=30)
    data = Folder(str(root))
    assert set(data.characters()) == {"angry", "other", "twin"}
    own = {clip for pair, clip in pairs(data, "self") if pair == "angry>angry"}
    assert own == {"angry_walk", "angry-run", "happy_walk", "happy-run"}
    assert "angry is one body in 2 folders: angry, happy" in data.notes


def test_files_without_a_rate_are_read_at_the_one_that_is_said(loose):
    path = loose / "walk.bvh"
    head, numbers = path.read_text().split("Frame Time: ")
    path.write_text(f"{head}Frame Time: 0\n{numbers.partition(chr(10))[2]}")
    assert "walk.bvh ('Frame Time:' says no time" in Folder(str(loose)).unreadable.sentence
    data = Folder(str(loose), rate=30.0)
    assert data.unreadable is None
    (info,) = (each for each in data.cases("retarget", "self") if each.clip == "walk")
    assert data.load(info).source.fps == 30.0


def test_glb_files_stand_beside_bvh_files_and_every_take_is_a_clip(loose):
    body = importer.load(loose / "walk.bvh", Reading(unit="cm")).motion
    gltf.write(loose / "again.glb", body)
    like = importer.load(loose / "again.glb")
    write_into.write(loose / "pair.glb", body.resample(15.0), like)
    dataset = Folder(str(loose), fps=0, unit="auto")
    characters = dataset.characters()
    assert "again" in characters
    clips = {info.clip: info for info in every_case(dataset)}
    assert {"again", "pair-pair", "pair-again", "walk", "wave", "xbot"} == set(clips)
    assert clips["again"].frames == body.frames == 20
    assert clips["pair-pair"].frames == 5  # every fourth
    assert clips["again"].source == clips["pair-again"].source == clips["pair-pair"].source
    case = dataset.load(clips["pair-again"])
    np.testing.assert_allclose(case.source.positions, body.positions, atol=1e-5)
    assert dataset.load(clips["walk"]).source.frames == body.frames
    assert "readers " in dataset.content
    assert "readers " not in Folder(str(loose / "walk.bvh")).content


def test_files_of_smpl_stand_beside_others(loose):
    """Clips of joint positions that show one body's bones are of one body, however noisy their angles."""
    random = np.random.default_rng(5)
    person(random, frames=6).save(loose / "zed.glb")
    smpl_files.archive(loose / "amass.npz", smpl_files.parameters(random))
    (loose / "shape.npz").write_bytes((loose / "amass.npz").read_bytes()[:200])
    joints = smpl_files.danced(Character.of("body", skeletons.average(BODY)))
    np.save(loose / "m1.npy", joints[:120])
    np.save(loose / "m2.npy", 1.1 * joints[:50] / 1.1)
    longer = skeletons.offsets(BODY) * np.where(np.arange(22) == 4, 1.2, 1.0)[:, None]
    other = Skeleton(BODY.joints, np.array(BODY.parents), longer)
    np.save(loose / "tall.npy", smpl_files.danced(Character.of("tall", other)))
    dataset = Folder(str(loose), fps=0)
    assert set(dataset.characters()) == {"amass", "m1", "tall", "walk", "xbot", "zed"}
    clips = {info.clip: info for info in every_case(dataset)}
    assert clips["m2"].source == "m1"
    assert [clips[name].frames for name in ("amass", "m1", "m2", "tall", "walk", "zed")] == [
        12, 120, 50, 200, 20, 6
    ]  # fmt: skip
    case = dataset.load(clips["m2"])
    np.testing.assert_allclose(case.source.positions, joints[:50], atol=1e-5)
    assert case.source.fps == 20.0
    assert any(note.startswith("1 of 9 files cannot be read: shape.npz (") for note in dataset.notes)
    assert "readers " in dataset.content
    faster = Folder(str(loose), fps=0, rate=30.0)
    assert faster.load(clips["m2"]).source.fps == 30.0


def test_people_of_amass_have_the_joints_of_the_body_model(tmp_path):
    random = np.random.default_rng(6)
    for person_, betas in (("ann", np.zeros(10)), ("eve", np.full(10, 2.0))):
        for clip in ("sit", "walk"):
            content = smpl_files.parameters(random) | {"betas": betas}
            smpl_files.archive(tmp_path / "amass" / person_ / f"{clip}.npz", content)
    models = tmp_path / "models"
    smpl_files.archive(models / "SMPLH_FEMALE.npz", smpl_files.model(random))
    plain = Folder(str(tmp_path / "amass"))
    dataset = Folder(str(tmp_path / "amass"), body_model=str(models))
    ann, eve = (dataset.characters()[name].skeleton for name in ("ann", "eve"))
    assert np.abs(ann.offsets - eve.offsets).max() > 0.005
    assert plain.characters()["ann"].skeleton.same_as(plain.characters()["eve"].skeleton)
    case = dataset.load(next(iter(dataset.cases("retarget", "intra"))))
    assert case.reference is not None
    assert case.target.mesh is not None
    other = smpl_files.archive(tmp_path / "other" / "SMPLH_FEMALE.npz", smpl_files.model(random))
    contents = [
        plain.content,
        dataset.content,
        Folder(str(tmp_path / "amass"), body_model=str(other)).content,
    ]
    assert len(set(contents)) == 3
    smpl_files.archive(models / "SMPLH_FEMALE.npz", {"v_template": np.zeros(3)})
    with pytest.raises(BenchError, match=r"no body of .* can be used: ann .*SMPL-H model"):
        _ = Folder(str(tmp_path / "amass"), body_model=str(models)).characters()


def test_acclaim_files_stand_beside_both(loose):
    asset = person(np.random.default_rng(4), frames=6)
    asset.save(loose / "robot.glb")
    bones, lines = ASF, [":FULLY-SPECIFIED", ":DEGREES"]
    for frame in range(1, 9):
        lines += [str(frame), f"root 0 16 {frame} 0 0 0", f"lfemur {frame} 0 0", f"rhumerus 0 {frame} 0"]
    (loose / "07.asf").write_text(bones)
    (loose / "07_01.amc").write_text("\n".join(lines))
    dataset = Folder(str(loose), fps=0.0)
    assert set(dataset.characters()) == {"07_01", "robot", "walk", "xbot"}
    assert not any("cannot be" in note for note in dataset.notes)
    (own,) = (info for info in dataset.cases("retarget", "self") if info.source == "07_01")
    assert (own.clip, own.frames, dataset.load(own).source.fps) == ("07_01", 8, 120.0)
    across = [info for info in dataset.cases("retarget", "cross") if info.source == "07_01"]
    assert {info.target for info in across} == {"robot", "walk", "xbot"}
    halved = Folder(str(loose), fps=30.0, rate=60.0)
    assert halved.content != Folder(str(loose), fps=30.0).content
    (own,) = (info for info in halved.cases("retarget", "self") if info.source == "07_01")
    assert own.frames == halved.load(own).source.frames == 4
    before = dataset.content
    (loose / "07.asf").write_text(bones.replace("length 7", "length 8"))
    assert Folder(str(loose), fps=0.0).content != before
    with pytest.raises(BenchError, match="rate=-1 is not a frame rate"):
        Folder(str(loose), rate=-1.0)


def test_content_follows_the_buffers_of_text_files(tmp_path):
    asset = person(np.random.default_rng(4), frames=6)
    asset.save(tmp_path / "a.gltf", linked="a.bin")
    before = Folder(str(tmp_path)).content
    data = bytearray((tmp_path / "a.bin").read_bytes())
    view = asset.content["bufferViews"][1]["byteOffset"]
    data[view : view + 16] = np.array([0, 0, 0, 1], "<f4").tobytes()
    (tmp_path / "a.bin").write_bytes(data)
    (tmp_path / "a.gltf").write_text((tmp_path / "a.gltf").read_text() + " ")
    text = Folder(str(tmp_path)).content
    assert text != before
    other = tmp_path / "other"
    other.mkdir()
    (other / "a.gltf").write_text((tmp_path / "a.gltf").read_text())
    (other / "a.bin").write_bytes(bytes(asset.data))
    assert Folder(str(other)).content != text


def test_wrong_folders_say_what_to_give(loose, tmp_path):
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "a.bvh").write_text("no motion")
    (tmp_path / "none").mkdir()
    for parameters, message in {
        ("", ""): "--root DIR",
        (str(tmp_path / "nowhere"), ""): "there is no folder or file",
        (str(tmp_path / "none"), ""): "holds no motion files",
        (str(tmp_path / "bad"), ""): r"none of the files of .* can be read: a\.bvh \(",
        (str(loose), str(tmp_path / "nowhere.bvh")): "there is no folder or file",
        (str(loose), str(tmp_path / "none")): "target .* holds no motion files",
    }.items():
        with pytest.raises(BenchError, match=message):
            Folder(*parameters).cases("retarget", "self")
    with pytest.raises(FileError, match=r"a\.bvh"):
        Folder(str(loose), target=str(tmp_path / "bad" / "a.bvh")).cases("retarget", "self")
    with pytest.raises(BenchError, match="not a frame rate"):
        Folder(str(loose), fps=-1.0)


def test_content_follows_bytes_and_parameters(loose):
    first = Folder(str(loose)).content
    assert Folder(str(loose)).content == first
    assert Folder(str(loose), fps=60.0).content != first
    path = loose / "walk.bvh"
    path.write_bytes(path.read_bytes() + b"\n")
    assert Folder(str(loose)).content != first


def test_a_roles_file_names_what_is_not_recognised(mini, rigs, tmp_path):
    root = mini({})
    rigs.a(root / "walk.bvh", rename={"LeftToeBase": "Bone_17"})
    roles = tmp_path / "roles.toml"
    roles.write_text('"Bone_17" = "left_toe"\n')
    assert "left_toe" not in Folder(str(root)).characters()["walk"].roles
    assert "left_toe" in Folder(str(root), roles=str(roles)).characters()["walk"].roles
    assert Folder(str(root)).content != Folder(str(root), roles=str(roles)).content
    with pytest.raises(BenchError, match="there is no folder or file"):
        Folder(str(root), roles=str(tmp_path / "nothing.toml")).characters()
