"""Verdicts: motions that are known to be right, and defects put into them on purpose."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import retarget_bench as rb
from retarget_bench.api import Case, Context
from retarget_bench.errors import BenchError
from retarget_bench.motion import bvh, importer, rotation, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import registry
from retarget_bench.verification.verdict import Verdict, defects, joints, penetration, verdict
from tests.motion.editing_bodies import body, gait, jump

WALK = "puppets/vesper>moppet/walk-001"
KICK = "puppets/jack>olga/kick_front-001"


@cache
def case(name: str) -> Case:
    data = registry.create("datasets", "puppets[size=tiny]")
    return data.load(next(each for each in data.cases("retarget", "cross") if each.id == name))


@cache
def solved(name: str) -> tuple[Motion, Motion]:
    """A source, and the same performance solved for another body: right, and no copy of rotations."""
    loaded = case(name)
    return loaded.source, loaded.reference


def found_in(source: Motion, result: Motion) -> set[tuple[str, str]]:
    return {(each.kind, each.part) for each in verdict(source, result).defects}


def changed(motion: Motion, change: Callable[[np.ndarray, np.ndarray], None]) -> Motion:
    """The motion after a change of its rotations and root, in place."""
    rotations, root = motion.rotations.copy(), motion.root.copy()
    change(rotations, root)
    return motion.character.motion(rotations, root, motion.fps)


def moved(motion: Motion, way: np.ndarray | list[float]) -> Motion:
    """The motion with its root moved by so much, in all frames alike or ``(frames, 3)``."""
    return motion.character.motion(motion.rotations, motion.root + np.asarray(way), motion.fps)


RIGHT, UP, FORWARD = np.eye(3)


def eased(frames: int, first: int, last: int) -> np.ndarray:
    """0, slowly up to 1 within ten frames after ``first``, and back before ``last``."""
    at = np.arange(frames)
    up, down = np.clip((at - first) / 10, 0, 1), np.clip((last - at) / 10, 0, 1)
    return np.sin(np.pi / 2 * np.minimum(up, down)) ** 2


def bent(motion: Motion, role: str, degrees: float, frames: slice) -> Motion:
    """A limb's lower joint turned about the body's left axis, against the reference pose."""
    joint = motion.character.joint_of[role]
    axis = rotation.rotate(
        rotation.conjugate(motion.character.reference_globals[joint]), np.array([1.0, 0.0, 0.0])
    )
    turn = rotation.from_rotation_vector(np.radians(degrees) * axis)

    def change(rotations: np.ndarray, root: np.ndarray) -> None:
        del root
        rotations[frames, joint] = rotation.multiply(rotations[frames, joint], turn[None])

    return changed(motion, change)


# ------------------------------------------------------------------------------------ nothing to look at
@pytest.mark.parametrize("every", [30, pytest.param(1, marks=pytest.mark.slow)])
def test_right_answers_of_other_bodies_have_nothing_to_look_at(every):
    """Puppets' references are solved for each body, keep contacts, and never come from a method."""
    data = registry.create("datasets", "puppets[size=tiny]")
    infos = [info for split in ("intra", "cross") for info in data.cases("retarget", split)]
    judged = {}
    for info in infos[::every]:
        loaded = data.load(info)
        judged[info.id] = verdict(loaded.source, loaded.reference).defects
    assert len(judged) >= 3
    assert judged == dict.fromkeys(judged, ())


def test_real_motion_held_by_ik_is_not_drowned_and_a_copy_slides(real_data):
    """LAFAN1's dance on a Mixamo character: ``ik`` holds its feet, and in copied poses they slide."""
    dance = importer.load(real_data / "lafan1/dance1_subject1.bvh").motion.at(slice(600))
    body = importer.load(next((real_data / "mixamo_san/Aj").glob("*.bvh"))).motion.character
    judged = {}
    for method in ("ik", "copy_rotations"):
        created = registry.create("methods", method)
        judged[method] = verdict(dance, created.retarget(dance, body, context=Context(seed=0)))
    assert len(judged["ik"].defects) <= 2
    assert sum(each.kind == "slide" for each in judged["copy_rotations"].defects) >= 5


# ---------------------------------------------------------------------------------- defects put in
@pytest.mark.parametrize(("role", "part"), [("left_leg", "left knee"), ("right_leg", "right knee")])
def test_a_knee_that_snaps_for_a_frame_is_found_and_nothing_that_follows_from_it(role, part):
    source, result = solved(WALK)
    snapped = bent(result, role, 70, slice(30, 31))
    judged = verdict(source, snapped)
    assert {(each.kind, each.part) for each in judged.defects} == {("snap", part)}
    (only,) = judged.defects
    assert only.first <= 30 <= only.last <= only.first + 4
    assert only.worst in (30, 31)
    assert only.amount == pytest.approx(70, abs=20)
    assert only.source < only.amount / 2
    assert only.severity > 1
    assert f"frames {only.first + 1}-{only.last + 1} (" in judged.text()
    assert f"{part} snaps ({only.amount:.0f} degrees in a frame; source {only.source:.0f})" in judged.text()
    assert judged.text().endswith("1 place to look at")


def test_a_snap_is_found_at_any_rate():
    source, result = solved(WALK)
    snapped = bent(result, "left_leg", 70, slice(30, 31))
    for fps in (60, 120):
        assert found_in(source.resample(fps), snapped.resample(fps)) == {("snap", "left knee")}
        assert found_in(source.resample(fps), result.resample(fps)) == set()


def test_an_elbow_that_is_straight_where_the_source_bends_it_is_found():
    bare = replace(case(KICK).target, skin=None)
    standing, straight = posed(bare, elbow=60.0), posed(bare, elbow=0.0)
    assert found_in(standing, straight) == {("straight", "left elbow")}
    assert found_in(straight, standing) == set()
    assert found_in(standing, posed(bare, elbow=20.0)) == set()


def test_a_jump_of_the_whole_body_is_one_place():
    source, result = solved(WALK)
    frame = (np.arange(result.frames) == 40)[:, None]
    judged = verdict(source, moved(result, 0.4 * result.character.measures.leg_length * frame * FORWARD))
    assert [each.kind for each in judged.defects] == ["speed"]
    assert judged.defects[0].first <= 40 <= judged.defects[0].last
    assert "more joints" in judged.defects[0].reason


def test_a_body_that_sinks_has_its_feet_in_the_floor():
    source, result = solved(WALK)
    height = result.character.height
    judged = verdict(source, moved(result, -0.08 * height * eased(result.frames, 15, 55)[:, None] * UP))
    assert {each.kind for each in judged.defects} == {"floor"}
    assert {each.part for each in judged.defects} == {"left foot", "right foot"}
    deepest = max(judged.defects, key=lambda each: each.amount)
    assert deepest.amount == pytest.approx(8 * height, rel=0.2)
    assert 15 <= deepest.worst <= 55
    assert found_in(source, moved(result, -0.01 * height * UP)) == set()


def test_a_floor_that_the_source_is_in_itself_is_no_defect_of_the_result():
    source, _ = solved(WALK)
    sunk = moved(source, -0.1 * UP)
    assert found_in(sunk, sunk) == set()


def test_a_foot_that_slides_while_the_sources_stands_is_found():
    source, result = solved(WALK)
    drift = 0.25 * result.character.height * np.linspace(0, 1, result.frames)
    slid = verdict(source, moved(result, drift[:, None] * RIGHT))
    assert {each.kind for each in slid.defects} == {"slide"}
    assert {each.part for each in slid.defects} <= {"left foot", "right foot"}
    shift = 100 * 0.25 * result.character.height / len(result.root)
    for each in slid.defects:
        assert each.amount == pytest.approx(shift * (each.last - each.first), rel=0.3, abs=1.5)


LOW_HIPS = {
    f"{side}UpLeg": ("Hips", (sign * 0.1, -0.3, 0.0)) for side, sign in (("Left", 1.0), ("Right", -1.0))
}
"""Legs from far below the hips: by these a body is larger than by its legs, and so are its root paths."""
LEDGES = [
    (1.1, 0.0, 20, 30),
    (0.0, -1.1, 20, 30),
    (0.0, -1.1, 90, 3),
    (0.0, -1.1, 20, 1),
    (0.8, 0.8, 20, 30),
]
"""High and low, metres; frames before and after the jump, of which the last are too few to stand."""


@pytest.mark.parametrize("ledge", LEDGES)
@pytest.mark.parametrize("shanks", [1.0, 0.7])
def test_a_jump_from_a_ledge_has_no_foot_in_the_floor(ledge, shanks):
    high, low, before, after = ledge
    source = jump(body(), high, low, before=before, after=after)
    result = rb.retarget(source, body(LOW_HIPS, shanks=shanks))
    assert verdict(source, result).defects == ()
    assert result.notes == (), "no edit moves it"


def test_feet_below_another_floor_than_that_at_the_origin_are_found():
    source = jump(body(), 0.0, -1.1)
    result = rb.retarget(source, body(LOW_HIPS))
    height, landed = result.character.height, (np.arange(source.frames) >= 40)[:, None]
    sunk = verdict(source, moved(result, -0.08 * height * landed * UP)).defects
    assert {each.part for each in sunk if each.kind == "floor"} == {"left foot", "right foot"}
    for each in (one for one in sunk if one.kind == "floor"):
        assert 38 <= each.first <= 42
        assert each.amount == pytest.approx(8 * height, rel=0.2)


@pytest.mark.parametrize("clip", ["stairs_up", "stairs_down"])
def test_stairs_are_floors(clip):
    """They grow with the body that is on them, by ``ik`` and in puppets' solved references."""
    data = registry.create("datasets", "puppets[size=tiny]")
    (info,) = (one for one in data.cases("retarget", "cross") if one.clip.startswith(clip))
    loaded = data.load(info)
    for result in (loaded.reference, rb.retarget(loaded.source, loaded.target)):
        assert "floor" not in {each.kind for each in verdict(loaded.source, result).defects}


@pytest.mark.parametrize("degrees", [-12.0, 12.0])
def test_a_slope_is_no_floor_to_be_in(degrees):
    """A walk turned as a whole, uphill or downhill."""
    source, result = solved(WALK)
    slope = rotation.about(np.array([1.0, 0.0, 0.0]), np.array(np.radians(degrees)))

    def tilt(rotations: np.ndarray, root: np.ndarray) -> None:
        rotations[:, 0] = rotation.multiply(slope[None], rotations[:, 0])
        root[:] = rotation.rotate(slope[None], root)

    uphill, up = changed(source, tilt), changed(result, tilt)
    assert "floor" not in {kind for kind, _ in found_in(uphill, up)}


def turned(motion: Motion, role: str, degrees: float, axis: tuple[float, float, float]) -> Motion:
    """A joint turned by so many degrees about an axis of its parent's frame, as it is at rest."""
    joint = motion.character.joint_of[role]
    parent = motion.character.skeleton.parents[joint]
    own = rotation.rotate(rotation.conjugate(motion.character.reference_globals[parent]), np.array(axis))
    turn = rotation.from_rotation_vector(np.radians(degrees) * own)

    def change(rotations: np.ndarray, root: np.ndarray) -> None:
        del root
        rotations[:, joint] = rotation.multiply(turn[None], rotations[:, joint])

    return changed(motion, change)


@pytest.mark.parametrize(
    ("role", "degrees", "axis", "part"),
    [
        ("spine_1", 40.0, (1.0, 0.0, 0.0), "trunk"),
        ("left_up_leg", 70.0, (0.0, 0.0, 1.0), "left thigh"),
        ("right_foot", 100.0, (0.0, 1.0, 0.0), "right foot"),
        ("left_arm", 80.0, (0.0, 0.0, 1.0), "left upper arm"),
    ],
)
def test_a_part_that_points_elsewhere_than_the_sources_is_found(role, degrees, axis, part):
    """As where a back is left out, or the sides of a file are exchanged."""
    body = replace(case(KICK).target, skin=None)
    standing = posed(body, elbow=20.0)
    away = turned(standing, role, degrees, axis)
    found = [each for each in verdict(standing, away).defects if each.kind == "turned"]
    assert part in {each.part for each in found}
    (one,) = (each for each in found if each.part == part)
    assert one.amount == pytest.approx(degrees, abs=12)
    assert (one.first, one.last) == (0, standing.frames - 1)
    assert f"{part} points elsewhere than the source's ({one.amount:.0f} degrees)" in one.reason
    slightly = turned(standing, role, 10.0, axis)
    assert not [each for each in verdict(standing, slightly).defects if each.kind == "turned"]


@pytest.mark.parametrize(
    ("turns", "parts"),
    [
        ({"left_up_leg": 35.0}, {"left foot"}),
        ({"spine_1": 20.0, "left_arm": 20.0}, {"left hand"}),
    ],
)
def test_ends_that_are_elsewhere_are_found_where_no_bone_points_away_by_much(turns, parts):
    standing = posed(replace(case(KICK).target, skin=None), elbow=20.0)
    away = slightly = standing
    for role, degrees in turns.items():
        away = turned(away, role, degrees, (0.0, 0.0, 1.0))
        slightly = turned(slightly, role, degrees / 4, (0.0, 0.0, 1.0))
    found = [each for each in verdict(standing, away).defects if each.kind in ("place", "turned")]
    assert {each.kind for each in found} == {"place"}
    assert {each.part for each in found} >= parts
    for each in found:
        assert (each.first, each.last) == (0, standing.frames - 1)
        joint, hips = standing.character.joints([each.part.replace(" ", "_"), "hips"])
        apart = (away.positions - standing.positions)[0]
        assert each.amount == pytest.approx(100 * np.linalg.norm(apart[joint] - apart[hips]), rel=1e-6)
        assert (
            f"{each.part} is elsewhere than the source's ({each.amount:.0f} cm, at this size)"
            in each.reason
        )
    assert not {"place", "turned"} & {kind for kind, _ in found_in(standing, slightly)}


def test_hands_and_heads_below_the_floor_are_found_as_feet_are():
    source, result = solved(WALK)
    body = result.character
    hands = [body.joint_of[role] for role in ("left_hand", "head")]
    sunk = np.array(result.positions)
    sunk[20:40, hands, 1] = -0.05 * body.height
    defects = verdict(source, body.positions(sunk, result.fps)).defects
    assert {each.part for each in defects if each.kind == "floor"} == {"left hand", "head"}
    for each in (one for one in defects if one.kind == "floor"):
        assert (each.first, each.last) == (20, 39)
        assert each.amount == pytest.approx(5 * body.height, abs=1.0)


def posed(body: Character, elbow: float, arm: float = 75.0, frames: int = 30) -> Motion:
    """Standing, the arms down by so many degrees, the left forearm turned on by more; from above the arms
    hang, and the forearm turns before the body."""
    turned = rotation.identity(frames, len(body.skeleton))
    for side, sign in (("left", -1.0), ("right", 1.0)):
        upper = rotation.from_rotation_vector(np.array([0.0, 0.0, sign * np.radians(arm)]))
        lower = rotation.from_rotation_vector(np.array([0.0, 0.0, sign * np.radians(elbow)]))
        for part in ("arm", "forearm", "hand"):
            both = part != "arm" and side == "left"
            turned[:, body.joint_of[f"{side}_{part}"]] = rotation.multiply(upper, lower) if both else upper
    local = transfer.from_relative(body, turned)
    root = np.repeat(body.standing_places[:1], frames, axis=0)
    return body.motion(local, root, 30.0)


def test_a_hand_in_the_belly_is_found_where_there_is_a_mesh():
    body = case(KICK).target
    bare = replace(body, skin=None)
    inside, beside = posed(body, elbow=100.0), posed(body, elbow=0.0, arm=45.0)
    source = posed(bare, elbow=100.0)
    judged = verdict(source, inside)
    assert {(each.kind, each.part) for each in judged.defects} == {("inside", "left hand")}
    assert (judged.defects[0].first, judged.defects[0].last) == (0, 29)
    assert found_in(inside, inside) == set(), "the source's own hand is as deep"
    assert found_in(posed(bare, elbow=0.0, arm=45.0), beside) == set()
    assert found_in(source, posed(bare, elbow=100.0)) == set(), "nothing is known of flesh"


def test_what_a_coarse_mesh_says_of_hands_is_what_the_mesh_says(monkeypatch):
    body = case(KICK).target
    motion = posed(body, elbow=100.0, frames=1)
    coarse = penetration.coarse_body(body).mesh
    fast = penetration.shares_inside(motion, np.array([0]))
    monkeypatch.setattr(penetration, "coarse_body", lambda body: body)
    exact = penetration.shares_inside(motion, np.array([0]))
    assert exact.keys() == fast.keys() == {"left", "right"}
    for side in exact:
        assert fast[side] == pytest.approx(exact[side], abs=0.15)
    assert len(coarse.vertices) < len(body.mesh.vertices)
    edges = np.sort(
        np.concatenate([coarse.faces[:, [0, 1]], coarse.faces[:, [1, 2]], coarse.faces[:, [2, 0]]])
    )
    assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all(), "closed as before"


# ---------------------------------------------------------------------------------------- all of it
def of_other_names(motion: Motion, path: Path, *names: str) -> Motion:
    """The motion read from a file whose joints have no names that mean anything, but for some."""
    old = motion.skeleton
    new = tuple(name if name in names else f"b{number:02d}" for number, name in enumerate(old.names))
    skeleton = Skeleton(new, old.parents, old.offsets, old.end_sites)
    bvh.write(path, replace(motion, character=replace(motion.character, skeleton=skeleton)), scale=100.0)
    return importer.load(path, Reading(unit="cm", up="y")).motion


def test_there_is_no_all_clear_for_roles_that_are_a_guess(tmp_path):
    walk = gait(body(), 40)
    guessed = of_other_names(walk, tmp_path / "odd.bvh")
    count = len([role for role in guessed.character.roles if role])
    assert len(guessed.character.guessed) == count
    other = gait(body(size=1.3), 40)
    for source, result in ((guessed, other), (other, guessed)):
        judged = verdict(source, result)
        sentence = f"{count} roles of odd are a guess, by the tree and the places of joints"
        assert judged.doubts == (sentence,)
        assert f"look at all of it: {sentence}" in judged.text()
        assert judged.summary == "no place stands out: look at all of it"
        assert judged.as_dict()["doubts"] == [sentence]
    roles = dict(zip(guessed.skeleton.names, guessed.character.roles, strict=True))
    stated = importer.load(tmp_path / "odd.bvh", Reading(unit="cm", up="y", roles=roles)).motion
    assert verdict(stated, other).summary == "nothing to look at"


def test_there_is_none_between_a_person_and_a_dog():
    dogs = registry.create("datasets", "puppets[size=tiny]").characters().values()
    dog = next(each for each in dogs if each.four_legged)
    walk = gait(body(), 30)
    for source, target in ((walk, dog), (gait(dog, 30), body())):
        judged = verdict(source, rb.retarget(source, target, "copy_rotations"))
        assert judged.doubts == (
            "one body has four legs and the other two: what each limb should do is a guess",
        )
        assert judged.summary.endswith("all of it")
    still = dog.motion(np.repeat(dog.reference_pose[None], 9, 0), np.zeros((9, 3)), 30.0)
    assert verdict(still, still).doubts == ()


def mirrored(motion: Motion) -> Motion:
    """As a left-handed file has it: everything to the other side, names where they were."""
    old = motion.character
    flat = np.array([-1.0, 1.0, 1.0])
    skeleton = Skeleton(old.skeleton.names, old.skeleton.parents, old.skeleton.offsets * flat)
    turns = motion.rotations * [1.0, 1.0, -1.0, -1.0]
    return Character.of("left", skeleton, sample=turns).motion(turns, motion.root * flat, motion.fps)


def test_there_is_none_for_what_was_read_wrongly():
    """Exchanged sides, a path in another unit, a back that is left out: nothing of it shows in a frame."""
    walk = gait(body(), 40)
    short = replace(walk, root=walk.root * 0.01)
    bent = np.array(walk.rotations)
    spine = walk.character.joint_of["spine_2"]
    bent[:, spine] = rotation.about(np.array([[1.0, 0.0, 0.0]] * 40), np.linspace(0.0, 0.5, 40))
    roles = tuple(None if role == "spine_2" else role for role in walk.character.roles)
    stiff = replace(walk.character, roles=roles).motion(bent, walk.root, 30.0)
    for source, words in (
        (mirrored(walk), "left and right arms and legs of left are exchanged"),
        (short, "100 times too short"),
        (stiff, "turns by up to 29 degrees and is left out"),
    ):
        judged = verdict(source, rb.retarget(source, body({"Tail": ("Hips", (0.0, 0.0, -0.2))}), "ik"))
        assert [each for each in judged.doubts if words in each], words
        assert judged.summary.endswith("all of it")


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("07_mirrored_left_handed/18_mirror.bvh", "arms and legs of 18_mirror are exchanged"),
        ("09_root_in_metres_bones_in_cm/19_root_m.bvh", "about 100 times too short"),
        ("21_quadruped_front_back/*.fbx", "what each limb should do is a guess"),
        ("01_spine_words_silent/bow_azure_kinect.bvh", ""),
        ("06_vrm_humanoid_ignored/09_vrm1_oddnames.vrm", ""),
        ("07_mirrored_left_handed/00_base.bvh", ""),
    ],
)
def test_an_all_clear_of_the_cases_is_earned(real_data, file, words):
    found = list((real_data / "cases").glob(file))
    if not found:
        pytest.skip("no cases")
    if found[0].suffix == ".fbx":
        pytest.importorskip("ufbx")
    source = rb.load_motion(found[0])
    judged = rb.verdict(source, rb.retarget(source, body()))
    assert bool(words) == any(words in each for each in judged.doubts)
    assert (judged.summary == "nothing to look at") == (not words)


# ------------------------------------------------------------------------------------------- the rest
def test_capes_are_named_and_are_no_defects():
    source, _ = solved(WALK)
    skeleton = source.skeleton
    spine = source.character.joint_of["spine_1"]
    caped = Skeleton(
        (*skeleton.names, "Cape_1", "Cape_2"),
        np.concatenate([skeleton.parents, [spine, len(skeleton)]]),
        np.concatenate([skeleton.offsets, [[0, 0, -0.1], [0, -0.4, 0]]]),
        skeleton.end_sites,
    )
    body = Character.of("caped", caped)
    extra = np.repeat(rotation.identity(1, 2), source.frames, axis=0)
    result = body.motion(np.concatenate([source.rotations, extra], axis=1), source.root, source.fps)
    judged = verdict(source, result)
    helpers = ("Spine1_split", "LeftShoulder_split", "RightShoulder_split")
    assert judged.undriven == ("Cape_1", "Cape_2", *helpers)
    assert judged.defects == ()
    names = ", ".join(("Cape_1", "Cape_2", *helpers))
    assert judged.text().splitlines() == [
        f"5 joints that nothing drives follow their parents: {names}",
        "nothing to look at",
    ]


def test_motions_of_other_lengths_rates_or_bodies_are_refused_in_a_sentence():
    source, result = solved(WALK)
    with pytest.raises(BenchError, match=r"has 65 frames at 30 per second, the result 64 at 30"):
        verdict(source, result.at(slice(64)))
    with pytest.raises(BenchError, match="resample or cut"):
        verdict(source, replace(result, fps=25.0))
    nobody = replace(result.character, roles=(None,) * len(result.skeleton))
    with pytest.raises(BenchError, match="known as hips"):
        verdict(source, replace(result, character=nobody))


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_motions_of_few_frames_have_a_verdict(frames):
    source, result = solved(WALK)
    assert verdict(source.at(slice(frames)), result.at(slice(frames))).defects == ()


def many() -> Verdict:
    """Ten snaps of one knee and one slide, of rising severity."""
    listed = [
        defects.Defect(
            "snap", "left knee", 10 * n, 10 * n + 2, 10 * n, 30.0, 1 / 3, "degrees", n + 2.0, "why"
        )
        for n in range(10)
    ]
    listed.append(defects.Defect("slide", "left foot", 5, 9, 7, 8.0, None, "cm", 1.1, "slides"))
    return Verdict(100, 30.0, tuple(sorted(listed, key=lambda each: -each.severity)), ())


def test_the_worst_are_printed_and_all_are_in_the_report():
    judged = many()
    assert [each.first for each in judged.worst] == [5, 70, 80, 90]
    assert judged.lines[0] == "look at: frames 6-10 (0.2 s): slides"
    assert judged.lines[-1] == "look at: 7 more like these"
    assert judged.summary == "11 places to look at"
    report = json.loads(json.dumps(judged.as_dict()))
    assert len(report["places"]) == 11
    first = report["places"][0]
    assert (first["first"], first["last"], first["worst"]) == (91, 93, 91)
    assert first["seconds"] == [3.0, 3.067]
    assert first["source"] == 0.3333
    assert report["places"][-1]["source"] is None


@pytest.mark.filterwarnings("ignore:.*(worse than|is a guess):UserWarning")
def test_verdicts_in_python_take_motions_and_files(tmp_path):
    source, result = solved(WALK)
    judged = rb.verdict(source, bent(result, "left_leg", 70, slice(30, 31)))
    assert repr(judged) == "<Verdict on 65 frames: 1 place to look at>"
    assert str(judged) == judged.text()
    answer = rb.retarget(source, result.character, "copy_rotations")
    path = answer.save(tmp_path / "mine.bvh")
    assert rb.verdict(path, path).summary == "nothing to look at"
    with pytest.raises(BenchError, match="verdict: source is 3"):
        rb.verdict(3, result)


def test_local_maxima_are_those_of_a_loop():
    values = np.random.default_rng(0).normal(size=20)
    for radius in (0, 1, 4, 30):
        expected = [values[max(0, k - radius) : k + radius + 1].max() for k in range(20)]
        np.testing.assert_array_equal(joints.maximum_around(values, radius), expected)
