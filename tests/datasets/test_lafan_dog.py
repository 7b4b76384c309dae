"""LAFAN1's people and MANN's dog: splits by name, cases without references, folders that are not theirs.

The files are small stand-ins that are written on the spot, called as in the archives."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.api import SPLITS
from retarget_bench.datasets.lafan_dog import LafanDog
from retarget_bench.datasets.lafan_dog.takes import PAN_TAKES, TAKES, cut, part_of
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.errors import BenchError
from retarget_bench.motion import bvh, kinematics
from retarget_bench.motion.character import Character
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification import contract
from tests.datasets.conftest import plain_rig, skeleton

PEOPLE = ("dance1_subject1", "ground1_subject5", "push1_subject2", "multipleActions1_subject1")
DOGS = ("D1_009_KAN01_001", "D1_009_KAN01_002", "D1_047z_KAN01_002", "D1_031_KAN01_001", "D1_003_KAN01_001")


def moving(
    body: Character, frames: int, speed: float, low: float, fps: float
) -> tuple[np.ndarray, np.ndarray]:
    """Its reference pose, swaying, with its hips on the way at ``low`` hip heights."""
    time = np.arange(frames) / fps
    pose = np.repeat(body.reference_pose[None], frames, axis=0)
    root = np.stack([0.0 * time, low * body.measures.hip_height + 0.0 * time, speed * time], axis=1)
    places, _ = kinematics.forward(body.skeleton, pose, np.zeros((frames, 3)))
    return pose, root - places[:, body.joint_of["hips"]]


@pytest.fixture(scope="module")
def bodies() -> dict[str, Character]:
    return {"person": Character.of("p", skeleton(plain_rig())), "dog": Puppets().characters()["rex"]}


@pytest.fixture
def archives(tmp_path: Path, cache: Path, bodies: dict[str, Character]) -> Callable[..., Path]:
    """Writes DIR/lafan1 and DIR/dog and gives DIR."""
    assert cache

    def write(
        people: tuple[str, ...] = PEOPLE,
        dogs: tuple[str, ...] = DOGS,
        frames: int = 200,
        folder: str = "data",
    ) -> Path:
        for species, names, fps in (("person", people, 30.0), ("dog", dogs, 60.0)):
            for number, name in enumerate(names):
                place = tmp_path / folder / {"person": "lafan1", "dog": "dog"}[species] / f"{name}.bvh"
                place.parent.mkdir(parents=True, exist_ok=True)
                body = bodies[species]
                speed = (0.0, 1.5)[number % 2]
                count = round(frames * fps / 30.0)
                motion = body.motion(*moving(body, count, speed, 1.0, fps), fps)
                bvh.write(place, motion, scale=100.0)
        return tmp_path / folder

    return write


@given(number=st.integers(1, 9), subject=st.integers(1, 5), what=st.sampled_from(["walk", "run", "fight"]))
def test_a_take_of_people_is_in_one_part_with_all_of_its_recording(
    number: int, subject: int, what: str
) -> None:
    own = part_of("person", f"{what}{number}_subject{subject}")
    assert own in ("train", "validation", "test")
    assert own == part_of("person", f"{what}{number}_subject{(subject % 5) + 1}")
    pan = part_of("person", f"{what}{number}_subject{subject}", pan=True)
    assert (pan == "test") == (subject == 1)


@given(session=st.integers(1, 60), take=st.integers(1, 9))
def test_takes_of_one_session_of_the_dog_stay_together(session: int, take: int) -> None:
    parts = {
        part_of("dog", f"D1_{session:03d}{z}_KAN01_{take + more:03d}") for z in ("", "z") for more in (0, 1)
    }
    assert len(parts) == 1


def test_the_papers_takes_are_its_23_with_six_of_subject_1() -> None:
    """17 to train on and 6 to test, as the paper's files have it."""
    parts = [part_of("person", name, pan=True) for name in PAN_TAKES]
    assert len(PAN_TAKES) == 23
    assert parts.count("test") == 6
    assert {TAKES["person"].fullmatch(name)["recording"][:3] for name in PAN_TAKES} == {
        "aim",
        "run",
        "spr",
        "wal",
    }


def test_parts_share_no_take(archives: Callable[..., Path]) -> None:
    data = LafanDog(str(archives()))
    tested = {info.clip for split in SPLITS for info in data.cases("retarget", split)}
    steering = {info.clip for split in SPLITS for info in data.validation().cases("retarget", split)}
    trained = {name for cast in data.training().values() for clips in cast.values() for name in clips.names}
    takes = [{clip.rpartition("-")[0] for clip in part} for part in (tested, steering, trained)]
    assert all(takes)
    assert sum(map(len, takes)) == len(set().union(*takes)) == len(PEOPLE) + len(DOGS)
    manifest = data.training_manifest()
    assert set(manifest["clips"]) == steering | trained
    with pytest.raises(BenchError, match="has no case"):
        data.load(data.validation().cases("retarget", "cross")[0])
    assert manifest["structures"] == [body.structure for body in data.characters().values()]


def test_with_all_of_the_papers_takes_its_rule_applies_and_the_label_says_so(
    archives: Callable[..., Path],
) -> None:
    root = str(archives(people=(*sorted(PAN_TAKES), "dance1_subject1"), frames=70))
    data = LafanDog(root)
    assert data.label == "lafan_dog (people split as in PAN)"
    people = {info.clip for info in data.cases("retarget", "cross") if info.source == "person"}
    assert {clip.rpartition("-")[0] for clip in people} == {n for n in PAN_TAKES if n.endswith("subject1")}
    assert "dance1_subject1.bvh" in " ".join(data.notes)
    assert LafanDog(root, protocol="own").label == "lafan_dog (own split)"
    assert LafanDog(root, protocol="own").content != data.content


def test_no_case_between_the_species_has_a_reference(archives: Callable[..., Path]) -> None:
    data = LafanDog(str(archives()))
    assert data.label == "lafan_dog (own split)"
    cast = data.characters()
    assert (cast["person"].four_legged, cast["dog"].four_legged) == (False, True)
    across = data.cases("retarget", "cross")
    assert {info.pair for info in across} == {"person>dog", "dog>person"}
    for info in across:
        case = data.load(info)
        assert case.reference is None
        assert case.alternative is None
        assert (case.source.frames, case.source.fps) == (info.frames, 30.0)
        assert case.target is cast[info.target]
        assert case.source.character is cast[info.source]
    assert not data.cases("retarget", "intra")
    for body in cast.values():
        for info in data.real("retarget", body.structure):
            case = data.load(info)
            assert (case.reference.positions == case.source.positions).all()
            assert case.target is body
    assert data.real("retarget", "nobody") == []


def test_motion_is_that_of_the_files_in_metres(
    archives: Callable[..., Path], bodies: dict[str, Character]
) -> None:
    """Whole takes: every second frame of the dog's 60, hips at their height."""
    data = LafanDog(str(archives()), seconds=600)
    for info in data.cases("retarget", "self"):
        source = data.load(info).source
        hips = source.positions[:, source.character.joint_of["hips"]]
        assert info.frames == 200
        assert hips[:, 1] == pytest.approx(bodies[info.source].measures.hip_height, rel=1e-4)
        distance = hips[-1, 2] - hips[0, 2]
        kind = "move" if distance > 0.1 else "idle"
        assert info.kind == kind
        assert distance == pytest.approx(1.5 * 199 / 30 if kind == "move" else 0.0, abs=1e-4)


@given(frames=st.integers(1, 5000), most=st.integers(66, 600))
def test_a_take_is_cut_without_gaps_or_overlaps(frames: int, most: int) -> None:
    clips = cut("dog", "D1_009_KAN01_001", frames, most)
    assert clips[0].first == 0
    assert clips[-1].end == frames
    assert all(a.end == b.first for a, b in pairwise(clips))
    assert max(c.frames for c in clips) - min(c.frames for c in clips) <= 1
    assert all(clip.frames <= 1.5 * most + 1 for clip in clips)
    assert len({clip.name for clip in clips}) == len(clips)


def test_results_are_known_by_what_the_files_hold(archives: Callable[..., Path]) -> None:
    first, second = LafanDog(str(archives())), LafanDog(str(archives(folder="moved")))
    assert first.content == second.content
    other = LafanDog(str(archives(folder="longer", frames=201)))
    assert other.content != first.content
    assert len({first.content, LafanDog(first._root, seconds=5).content, first.validation().content}) == 3


def listed(data: LafanDog) -> None:
    data.cases("retarget", "cross")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"root": ""}, "lafan_dog needs your copies"),
        ({"root": "/nowhere/at/all"}, "there is no folder or file /nowhere/at/all"),
        ({"people": "humans"}, r"holds no folder humans .* it holds dog, lafan1"),
        ({"people": "dog"}, r"no take of a person, called as in walk1_subject1.bvh; its BVH files are D1_"),
        ({"protocol": "pan"}, r"needs all 23 takes .*; 23 are not there: aiming1_subject1"),
        ({"seconds": 0.5}, r"seconds=0.5; clips last 2.2"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_told_in_a_sentence(
    archives: Callable[..., Path], changes: dict[str, str | float], message: str
) -> None:
    root = str(archives(frames=70))
    with pytest.raises(BenchError, match=message):
        listed(LafanDog(**({"root": root} | changes)))


def test_files_that_are_broken_or_of_other_bodies_are_left_out_and_told(
    archives: Callable[..., Path], bodies: dict[str, Character]
) -> None:
    root = archives()
    complete = LafanDog(str(root))
    names = {info.clip for info in complete.cases("retarget", "self")}
    (root / "lafan1" / "walk9_subject1.bvh").write_text("HIERARCHY\nnonsense")
    child = Character.of("c", skeleton(plain_rig(), 0.7))
    motion = child.motion(*moving(child, 100, 1.0, 1.0, 30.0), 30.0)
    bvh.write(root / "lafan1" / "zumba1_subject1.bvh", motion, scale=100.0)
    (root / "dog" / "notes.txt").write_text("hello")
    (root / "dog" / "std.bvh").write_text("HIERARCHY")
    data = LafanDog(str(root))
    assert {info.clip for info in data.cases("retarget", "self")} == names
    notes = " ".join(data.notes)
    assert "2 takes left out: walk9_subject1 (" in notes
    assert "zumba1_subject1 (has bones of another length" in notes
    assert "std.bvh" in notes


@pytest.mark.parametrize("frames", [1, 5, 29])
def test_takes_of_less_than_a_second_are_left_out_and_told(
    archives: Callable[..., Path], bodies: dict[str, Character], frames: int
) -> None:
    """One comes first by name: no body is told from it either."""
    root = archives()
    names = {info.clip for info in LafanDog(str(root)).cases("retarget", "self")}
    motion = bodies["person"].motion(*moving(bodies["person"], frames, 1.0, 1.0, 30.0), 30.0)
    bvh.write(root / "lafan1" / "aiming9_subject1.bvh", motion, scale=100.0)
    data = LafanDog(str(root))
    assert {info.clip for info in data.cases("retarget", "self")} == names
    note = (
        f"1 takes left out: aiming9_subject1 (has {frames} frames at 30 per second; clips have 30 or more)"
    )
    assert note in data.notes
    for name in PEOPLE:
        (root / "lafan1" / f"{name}.bvh").unlink()
    with pytest.raises(BenchError, match=f"no take of a person can be used: .*has {frames} frames"):
        listed(LafanDog(str(root)))


def test_a_folder_of_the_other_species_is_told(archives: Callable[..., Path]) -> None:
    root = archives()
    for number, path in enumerate(sorted((root / "dog").glob("*.bvh"))):
        path.rename(root / "lafan1" / f"walk{number + 1}_subject9.bvh")
    for number, path in enumerate(sorted((root / "lafan1").glob("[a-z]*_subject[1-5].bvh"))):
        path.rename(root / "dog" / f"D1_{number:03d}_KAN01_001.bvh")
    with pytest.raises(
        BenchError, match=r"no take of a person can be used: .*four legs, which is no person"
    ):
        listed(LafanDog(str(root)))


@pytest.fixture(scope="module")
def real(real_data: Path) -> LafanDog:
    if not (real_data / "lafan1").is_dir() or not (real_data / "dog").is_dir():
        pytest.skip(f"no takes of LAFAN1 and of the dog in {real_data}")
    return LafanDog(str(real_data))


def test_real_takes_keep_the_contract(real: LafanDog, real_data: Path) -> None:
    assert real.cases("retarget", "cross")
    contract.assert_contract("datasets", Spec("lafan_dog", {"root": str(real_data)}))
