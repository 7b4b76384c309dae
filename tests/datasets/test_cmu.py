"""CMU takes: parts by subject, figures that repeat subjects, files that are none; and the real folder."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.api import SPLITS, Context
from retarget_bench.datasets.cmu import PLACE, Cmu
from retarget_bench.datasets.cmu.onto import BODIES, METHOD, fault
from retarget_bench.datasets.cmu.takes import TESTED, TESTED_TAKES, VALIDATION, part_of, performer
from retarget_bench.datasets.puppets.generator.corpus.families import (
    VALIDATION_BODIES,
    families,
    only_tested,
)
from retarget_bench.errors import BenchError, Unusable
from retarget_bench.motion import rotation
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification import contract
from tests.datasets.conftest import plain_rig, skeleton, write_clip

TAKES = ("05_01", "05_03", "08_02b", "17_01", "35_02", "02_01", "daz_s08t01", "daz_s17t02", "daz_salsa01")


@pytest.fixture
def folder(tmp_path: Path, cache: Path) -> Callable[..., Path]:
    """Writes takes, a body of its own size for each performer."""
    assert cache

    def write(takes: tuple[str, ...] = TAKES, frames: int = 120) -> Path:
        sizes: dict[str, float] = {}
        for number, take in enumerate(takes):
            size = sizes.setdefault(performer(take), 1.0 + 0.05 * len(sizes))
            write_clip(
                tmp_path / "cmu" / f"{take}.bvh", skeleton(plain_rig(), size), frames=frames, seed=number
            )
        return tmp_path / "cmu"

    return write


def clips(data: Cmu) -> set[str]:
    return {name for cast in data.training().values() for each in cast.values() for name in each.names}


def test_parts_go_by_the_skeleton() -> None:
    assert (
        part_of("05_01")
        == part_of("05_20b")
        == part_of("daz_salsa01")
        == part_of("142_sad walk")
        == "train"
    )
    assert {part_of(f"{who}_11") for who in VALIDATION} == {"validation"}
    assert {part_of(f"{who}_11") for who in TESTED} == {part_of("2_01")} == {"test"}
    assert {part_of(take) for take in TESTED_TAKES} == {part_of("5_3b")} == {None}


def test_a_figure_repeats_only_what_is_trained_on() -> None:
    assert part_of("daz_s05t01") == "train"
    assert part_of("daz_s05t03") is part_of("daz_s17t01") is part_of("daz_s2t01") is None


@given(st.integers(1, 144), st.integers(1, 40), st.sampled_from(["", "b", "c"]))
def test_all_takes_of_a_skeleton_are_in_one_part(subject: int, take: int, piece: str) -> None:
    parts = {part_of(f"{subject:02d}_{take:02d}{piece}"), part_of(f"{subject:02d}_{take}")} - {None}
    assert len(parts) <= 1
    assert parts <= {part_of(f"{subject:02d}_77")}


def test_what_is_trained_on_is_neither_tested_nor_validates(folder: Callable[..., Path]) -> None:
    data = Cmu(str(folder()))
    validation = data.validation()
    assert validation is not None
    assert clips(data) == {"05_01", "08_02b", "daz_s08t01", "daz_salsa01"}
    clips_of = {
        name: {i.clip for s in SPLITS for i in part.cases("retarget", s)}
        for name, part in (("test", data), ("validation", validation))
    }
    assert clips_of == {"test": {"02_01"}, "validation": {"17_01", "35_02"}}
    manifest = data.training_manifest()
    assert set(manifest["clips"]) == clips(data) | {"17_01", "35_02"}
    assert set(manifest["characters"]) == {"cmu05", "cmu08", "cmu_daz", "cmu17", "cmu35"}
    assert data.training_notes[0].startswith("2 files left out: 05_03 (")


def test_cases_of_one_body_have_a_reference(folder: Callable[..., Path]) -> None:
    data = Cmu(str(folder()), part="validation")
    for info in data.cases("retarget", "self"):
        case = data.load(info)
        assert case.reference is case.source
    for info in data.cases("retarget", "intra"):
        case = data.load(info)
        assert case.reference is None
        assert case.source.character.name != case.target.name
    assert len(data.cases("retarget", "intra")) == 2
    with pytest.raises(BenchError, match="no case"):
        Cmu(str(folder())).load(info)


def test_long_takes_are_cut_into_cases(folder: Callable[..., Path]) -> None:
    data = Cmu(str(folder(("17_01", "05_01"), frames=2000)), part="validation")
    infos = data.cases("retarget", "self")
    assert [info.clip for info in infos] == ["17_01-01", "17_01-02", "17_01-03"]
    assert sum(info.frames for info in infos) == 1000
    assert [data.load(info).source.frames for info in infos] == [info.frames for info in infos]


def test_takes_of_another_skeleton_are_left_out(folder: Callable[..., Path]) -> None:
    place = folder(("05_01",))
    write_clip(place / "05_02.bvh", skeleton(plain_rig(), 1.3), frames=100, seed=3)
    (place / "05_04.bvh").write_text("nothing")
    write_clip(place / "05_05.bvh", skeleton(plain_rig()), frames=20, seed=3)
    data = Cmu(str(place))
    assert clips(data) == {"05_01"}
    for message in ("05_02 (another skeleton", "05_04 (", "05_05 (10 frames"):
        assert message in data.training_notes[0]


def test_places_that_hold_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(PLACE, raising=False)
    with pytest.raises(BenchError, match=PLACE):
        Cmu().training()
    monkeypatch.setenv(PLACE, str(tmp_path / "none"))
    with pytest.raises(BenchError, match="there is no folder"):
        Cmu().training()
    (tmp_path / "a.txt").touch()
    with pytest.raises(BenchError, match=r"holds no takes .* a\.txt"):
        Cmu(str(tmp_path)).training()


def test_it_keeps_the_contract(folder: Callable[..., Path]) -> None:
    contract.assert_contract("datasets", Spec("cmu", {"root": str(folder())}))


def test_the_real_folder(real_data: Path, cache: Path) -> None:
    """An hour of 20 skeletons to train on, seven minutes of four to validate; figures read rightly."""
    assert cache
    data = Cmu(str(real_data / "cmu_train"))
    cast = {name: motions for each in data.training().values() for name, motions in each.items()}
    assert len(cast) == 19
    assert sum(map(len, cast.values())) == 272
    for name in ("cmu05", "cmu_daz", "cmu_ltd"):
        motion = cast[name][0]
        assert 1.4 < motion.character.height < 2.0
        assert np.isfinite(motion.rotations).all()
        assert motion.fps == 30.0
    validation = data.validation()
    assert validation is not None
    assert set(validation.characters()) == {"cmu17", "cmu35", "cmu49", "cmu91"}
    cases = {info.clip.partition("-")[0] for s in SPLITS for info in validation.cases("retarget", s)}
    assert len(cases) == 53
    assert not {name for motions in cast.values() for name in motions.names} & cases


@pytest.fixture
def onto(folder: Callable[..., Path]) -> Cmu:
    return Cmu(str(folder(("05_01", "05_02", "08_01", "17_01"), frames=300)), bodies=12)


def test_takes_are_put_on_training_bodies_of_two_legs(onto: Cmu) -> None:
    apart = {body.name for family in families() for body in family.bodies.values() if only_tested(body)}
    cast = {name for bodies in onto.training().values() for name in bodies if not name.startswith("cmu")}
    assert len(cast) > 8
    assert not cast & (apart | set(VALIDATION_BODIES))
    assert set(onto.training()) >= {"body22", "body28", "body23"}
    assert "dog21" not in onto.training()
    takes = [
        take
        for bodies in onto.training().values()
        for name in cast & set(bodies)
        for take in bodies[name].names
    ]
    assert Counter(takes) == dict.fromkeys(("05_01", "05_02", "08_01"), BODIES)
    assert cast < set(onto.training_manifest()["characters"])
    assert "17_01" not in takes


def test_performers_can_be_left_out_of_training(onto: Cmu) -> None:
    alone = Cmu(onto._root, bodies=onto._bodies, own=False)
    everybody, drawn = (
        {name for cast in data.training().values() for name in cast} for data in (onto, alone)
    )
    assert drawn == {name for name in everybody if not name.startswith("cmu")} != everybody
    with pytest.raises(BenchError, match="bodies=NUMBER"):
        Cmu(onto._root, own=False)


def test_they_are_what_ik_makes_of_them(onto: Cmu) -> None:
    take, name = "05_01", onto._onto.chosen["05_01"][0]  # type: ignore[union-attr]
    (clips,) = (cast[name] for cast in onto.training().values() if name in cast)
    clip = clips[list(clips.names).index(take)]
    expected = bound.method(METHOD).built.retarget(onto.motion(take), clip.character, context=Context())
    assert np.degrees(rotation.angle(clip.rotations, expected.rotations)).max() < 1e-3  # type: ignore[union-attr]
    assert np.abs(clip.root - expected.root).max() < 1e-5  # type: ignore[union-attr]


def test_pairs_of_takes_are_marked_inexact(onto: Cmu) -> None:
    pairs = onto.training_pairs()
    assert pairs is not None
    assert Cmu(onto._root).training_pairs() is None
    names = set()
    for index in range(0, len(pairs), 17):
        pair = pairs[index]
        source, target = pair.source.motion, pair.target.motion
        assert not pair.exact
        assert source.frames == target.frames
        assert source.character.name != target.character.name
        assert pair.source.touches is None
        for each in (pair.source, pair.target):
            assert each.contacts is not None
            assert each.contacts.planted.shape == (source.frames, len(each.contacts.roles))
        names |= {source.character.name, target.character.name}
    assert {"cmu05", "cmu08"} < names
    again = Cmu(onto._root, bodies=12).training_pairs()
    assert again is not None
    np.testing.assert_array_equal(again[100].target.motion.rotations, pairs[100].target.motion.rotations)


def test_what_fails_a_check_is_left_out(onto: Cmu, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("retarget_bench.datasets.cmu.onto.LOWER", -10.0)
    names = [name for cast in onto.training().values() for name in cast if not name.startswith("cmu")]
    (clips,) = (cast[names[0]] for cast in onto.training().values() if names[0] in cast)
    with pytest.raises(Unusable, match="below the floor"):
        clips[0]
    pairs = onto.training_pairs()
    assert pairs is not None
    with pytest.raises(IndexError, match="no performance"):
        pairs[0]


def test_checks_of_contact_speed_and_floor(onto: Cmu) -> None:
    """A motion passes against itself; sliding, snapping and sinking ones do not."""
    source = onto.motion("05_01")
    still = replace(
        source, rotations=source.rotations[:1].repeat(60, 0), root=source.root[:1].repeat(60, 0)
    )
    assert fault(source, source) == fault(still, still) == ""
    slides = replace(still, root=still.root + 0.05 * np.arange(60)[:, None] * [0.0, 0.0, 1.0])
    assert "contact (recall 0.00)" in fault(still, slides)
    snaps = still.rotations.copy()
    snaps[30, 5] = rotation.multiply(snaps[30, 5], rotation.from_rotation_vector(np.array([1.0, 0.0, 0.0])))
    assert "too fast (57 degrees" in fault(still, replace(still, rotations=snaps))
    assert "below the floor (by 0.1" in fault(still, replace(still, root=still.root - [0.0, 0.2, 0.0]))
