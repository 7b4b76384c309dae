"""What is written comes back: the same numbers, the same hierarchy, the same text."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from retarget_bench.errors import FileError, NotSupported, SkeletonError
from retarget_bench.motion import bvh, kinematics, rotation
from retarget_bench.motion.bvh.document import POSITIONS, ROTATIONS, Document, Hierarchy
from retarget_bench.motion.bvh.writing import table_text
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import EndSite, Skeleton
from tests.examples import examples

BODY = Skeleton(
    names=("Hips", "Spine", "LeftUpLeg", "LeftFoot", "Head"),
    parents=np.array([-1, 0, 0, 2, 1]),  # not depth first: the format wants Head before LeftUpLeg
    offsets=np.array([[0, 0.95, 0.01], [0, 0.1, 0], [0.1, 0, 0], [0, -0.9, 0], [0, 1 / 3, 1e-7]]),
    end_sites=(EndSite(3, (0.0, -0.05, 0.12)), EndSite(4, (0.0, 0.2, 0.0)), EndSite(0, (0.0, 0.0, 0.0))),
)


def motion(skeleton: Skeleton = BODY, frames: int = 7, *, low: float = 0.9, seed: int = 0) -> Motion:
    rng = np.random.default_rng(seed)
    turned = rotation.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    root = np.array([0, low, 0]) + rng.normal(scale=0.01, size=(frames, 3))
    return Motion(_body(skeleton), turned, root, 30.0)


def _body(skeleton: Skeleton) -> SimpleNamespace:
    """All that a motion asks of its character here."""
    return SimpleNamespace(name="body", skeleton=skeleton)


@given(
    hnp.arrays(
        np.float64,
        hnp.array_shapes(min_dims=2, max_dims=2, max_side=6),
        elements=st.floats(-1e4, 1e4) | st.sampled_from([0.0, -0.0, 0.5, 1e-6, 999.999999, 9999.5, 1e5]),
    ),
    st.sampled_from([6, 8]),
)
def test_fixed_decimals_are_written_as_c_does(values: np.ndarray, decimals: int) -> None:
    values = np.round(values, decimals)
    exact = np.array_equal(np.round(values, 6), values)
    shown = 6 if exact else 8
    expected = "".join(" ".join(f"{v:.{shown}f}" for v in row) + "\n" for row in values.tolist())
    assert table_text(values).decode() == expected


@st.composite
def documents(draw: st.DrawFn) -> Document:
    """Trees of any shape, any channels in any order, any numbers."""
    count = draw(st.integers(1, 8))
    parents = [-1]
    for joint in range(1, count):
        line = [joint - 1]  # depth first: the new joint hangs on the last one or on one above it
        while parents[line[-1]] >= 0:
            line.append(parents[line[-1]])
        parents.append(draw(st.sampled_from(line)))
    number = st.floats(allow_nan=False, allow_infinity=False, width=64)
    channels = tuple(
        tuple(draw(st.permutations([*ROTATIONS, *(POSITIONS if draw(st.booleans()) else ())])))
        for _ in range(count)
    )
    sites = [EndSite(joint, tuple(draw(st.tuples(number, number, number)))) for joint in range(count)]
    hierarchy = Hierarchy(
        names=tuple(f"J {joint}:é" for joint in range(count)),
        parents=np.array(parents),
        offsets=draw(hnp.arrays(np.float64, (count, 3), elements=number)),
        channels=channels,
        end_sites=tuple(site for site in sites if draw(st.booleans())),
    )
    shape = (draw(st.integers(1, 3)), hierarchy.columns)
    return Document(hierarchy, 1 / 60, draw(hnp.arrays(np.float64, shape, elements=number)))


@examples(60)
@given(document=documents())
def test_documents_come_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, document: Document
) -> None:
    path = tmp_path_factory.mktemp("w") / "a.bvh"
    bvh.write_document(path, document)
    text = path.read_bytes()
    back = bvh.parse(path)
    assert back.hierarchy.names == document.hierarchy.names
    assert back.hierarchy.channels == document.hierarchy.channels
    assert back.hierarchy.parents.tolist() == document.hierarchy.parents.tolist()
    assert sorted(back.hierarchy.end_sites, key=lambda site: site.parent) == list(
        document.hierarchy.end_sites
    )
    assert back.hierarchy.offsets.tobytes() == document.hierarchy.offsets.tobytes()
    assert back.values.tobytes() == document.values.tobytes()
    assert back.frame_time == document.frame_time
    bvh.write_document(path, back)
    assert path.read_bytes() == text


def test_the_layout(tmp_path: Path) -> None:
    hierarchy = Hierarchy(
        names=("A", "B", "C"),
        parents=np.array([-1, 0, 0]),
        offsets=np.array([[0, 1, 0], [0.25, 0, 0], [1e-7, 0, 0]]),
        channels=(("Xposition", "Zrotation"), (), ("Yrotation",)),
        end_sites=(EndSite(1, (0.0, 1.5, 0.0)),),
    )
    bvh.write_document(tmp_path / "a.bvh", Document(hierarchy, 0.016667, np.array([[1.5, -2, 0.125]])))
    assert (tmp_path / "a.bvh").read_text() == (
        "HIERARCHY\nROOT A\n{\n"
        "\tOFFSET 0.000000 1.000000 0.000000\n\tCHANNELS 2 Xposition Zrotation\n"
        "\tJOINT B\n\t{\n\t\tOFFSET 0.250000 0.000000 0.000000\n\t\tCHANNELS 0\n"
        "\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0.000000 1.500000 0.000000\n\t\t}\n\t}\n"
        "\tJOINT C\n\t{\n\t\tOFFSET 1e-07 0.000000 0.000000\n\t\tCHANNELS 1 Yrotation\n\t}\n}\n"
        "MOTION\nFrames: 1\nFrame Time: 0.016667\n1.500000 -2.000000 0.125000\n"
    )


@pytest.mark.parametrize("order", ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"])
def test_motions_come_back(tmp_path: Path, order: str) -> None:
    before = motion()
    bvh.write(tmp_path / "a.bvh", before, order=order)
    after = bvh.read(tmp_path / "a.bvh")
    assert after.skeleton.names == ("Hips", "Spine", "Head", "LeftUpLeg", "LeftFoot")
    same = [BODY.index(name) for name in after.skeleton.names]
    assert np.degrees(rotation.angle(after.rotations, before.rotations[:, same])).max() < 1e-7
    np.testing.assert_allclose(after.root, before.root, atol=1e-8)
    np.testing.assert_array_equal(after.skeleton.offsets, BODY.offsets[same])
    sites = {(BODY.names[site.parent], site.offset) for site in BODY.end_sites}
    assert {(after.skeleton.names[site.parent], site.offset) for site in after.skeleton.end_sites} == sites
    assert after.fps == 30
    places, _ = kinematics.forward(after.skeleton, after.rotations, after.root)
    np.testing.assert_allclose(places, before.positions[:, same], atol=1e-7)


def test_at_gimbal_lock_the_rotation_comes_back(tmp_path: Path) -> None:
    steps = np.radians([89.99999, 90.0, 90.0000001, -90.0])
    angles = np.stack([np.full(4, 0.3), steps, np.full(4, -1.1)], axis=-1)
    turned = np.broadcast_to(rotation.from_euler(angles, "ZXY")[:, None], (4, len(BODY), 4))
    before = Motion(_body(BODY), turned, np.tile([0, 0.9, 0], (4, 1)), 30)
    bvh.write(tmp_path / "a.bvh", before)
    after = bvh.read(tmp_path / "a.bvh")
    assert np.degrees(rotation.angle(after.rotations, before.rotations)).max() < 1e-6


@pytest.mark.parametrize("low", [0.9, 0.0, -0.05, -0.5, -3.0])
def test_places_never_come_back_as_relative(tmp_path: Path, low: float) -> None:
    still = rotation.identity(5, len(BODY))
    before = Motion(_body(BODY), still, np.tile([1.0, low, 2.0], (5, 1)), 60)
    bvh.write(tmp_path / "a.bvh", before)
    np.testing.assert_allclose(bvh.read(tmp_path / "a.bvh").root, before.root, atol=1e-8)


@pytest.mark.parametrize("fps", [24, 25, 30, 60, 120, 29.97, 30 / 1.001, 37.5])
def test_the_rate_comes_back(tmp_path: Path, fps: float) -> None:
    bvh.write(tmp_path / "a.bvh", Motion(_body(BODY), motion().rotations, motion().root, fps))
    assert bvh.read(tmp_path / "a.bvh").fps == pytest.approx(fps, rel=1e-12)


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    good = motion()
    broken = good.root.copy()
    broken[3, 1] = np.nan
    with pytest.raises(FileError, match="frame 4 of the motion holds NaN"):
        bvh.write(path, Motion(good.character, good.rotations, broken, 30))
    with pytest.raises(FileError, match="no frames"):
        bvh.write(path, good.at(slice(0, 0)))
    with pytest.raises(NotSupported, match="ZXZ"):
        bvh.write(path, good, order="ZXZ")
    with pytest.raises(NotSupported, match="scale"):
        bvh.write(path, good, scale=0)
    for name in ("a{b", " a", "a\nb", "\ud800"):
        skeleton = Skeleton((name,), np.array([-1]), np.zeros((1, 3)))
        with pytest.raises(FileError, match="cannot stand in a BVH file"):
            bvh.write(path, motion(skeleton))
    assert not path.exists()
    with pytest.raises(SkeletonError):
        Skeleton(("",), np.array([-1]), np.zeros((1, 3)))
