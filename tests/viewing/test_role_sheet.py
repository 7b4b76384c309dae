"""The picture of the roles that were found in a file."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from retarget_bench import cli
from retarget_bench.motion.importer import Reading, load
from retarget_bench.viewer.colours import INK
from retarget_bench.viewer.role_sheet import (
    COLOURS,
    GROUPS,
    LINE,
    Label,
    halves,
    joint_groups,
    role_sheet,
    spread,
)
from tests.motion.animal_rigs import bird, horse, written

places = st.lists(st.tuples(st.floats(0, 500), st.floats(0, 700)), max_size=80)


@given(places)
def test_labels_do_not_touch_and_stay_beside_the_view(points):
    labels = [Label(str(number), at, INK) for number, at in enumerate(points)]
    left, right = halves(labels, 700 // LINE)
    assert sorted(label.words for label in left + right) == sorted(label.words for label in labels)
    assert all(a.at[0] <= b.at[0] for a in left for b in right)
    for column in (left, right):
        set_out = spread(column, 0.0, 0.0, 700.0)
        heights = [height for _, height in set_out]
        assert all(b - a >= LINE - 1e-6 for a, b in pairwise(heights))
        assert all(LINE / 2 - 1e-6 <= height <= 700 - LINE / 2 + 1e-6 for height in heights)


def test_labels_with_room_stand_at_their_joints():
    labels = [Label(str(y), (0.0, float(y)), INK) for y in (400, 100, 250)]
    assert [(label.words, height) for label, height in spread(labels, 0.0, 0.0, 700.0)] == [
        ("100", 100.0),
        ("250", 250.0),
        ("400", 400.0),
    ]


def test_bones_are_coloured_by_side_and_grey_without_a_role(tmp_path):
    imported = load(written(tmp_path / "hen.bvh", bird(), scale=100))
    groups = dict(zip(imported.motion.skeleton.names, joint_groups(imported.motion.character), strict=True))
    group_of = {name: GROUPS[group] for name, group in groups.items()}
    assert (group_of["Bip01 L Foot"], group_of["Bip01 R Hand"]) == ("left", "right")
    assert (group_of["Bip01 Neck"], group_of["BN_Tail02"], group_of["Bone_Beak"]) == (
        "middle",
        "middle",
        "no role",
    )
    picture = np.asarray(role_sheet(imported))
    front = picture[100:, 300:760].reshape(-1, 3).astype(int)
    for colour, least in zip(COLOURS, (50, 50, 50, 10), strict=True):  # a beak is a thin line
        assert (np.abs(front - colour).max(axis=1) < 4).sum() > least
    side = {name: (picture == COLOURS[GROUPS.index(name)]).all(axis=-1) for name in ("left", "right")}
    across = {name: np.argwhere(mask[120:, 300:760])[:, 1].mean() for name, mask in side.items()}
    assert across["right"] < across["left"]  # seen from the front


@pytest.mark.parametrize("facing", [0.0, 130.0])
def test_the_body_faces_the_eye_however_the_file_turns_it(tmp_path, facing):
    pictures = [
        np.asarray(role_sheet(load(written(tmp_path / "horse.bvh", horse(), scale=100, facing=each))))
        for each in (0.0, facing)
    ]
    assert pictures[0].shape == pictures[1].shape
    assert (pictures[0][80:] == pictures[1][80:]).mean() > 0.999


def test_the_command_draws_one_file(tmp_path, capsys):
    file = written(tmp_path / "hen.bvh", bird(), scale=100)

    def bench(*arguments: object) -> tuple[int, str]:
        with pytest.raises(SystemExit) as stop:
            cli.main([str(each) for each in arguments])
        return int(stop.value.code or 0), capsys.readouterr().err

    assert bench("doctor", file, "--sheet", tmp_path / "hen.png") == (0, "")
    with Image.open(tmp_path / "hen.png") as picture:
        assert picture.format == "PNG"
        assert min(picture.size) > 600
    for arguments in ((file, file, "--sheet", tmp_path / "x.png"), (file, "--sheet", tmp_path / "x.jpg")):
        code, message = bench("doctor", *arguments)
        assert code == 2
        assert "--sheet" in message
    assert not (tmp_path / "x.png").exists()


def test_bodies_without_any_role_are_drawn(real_data, tmp_path):
    """Joints without roles are labelled at the side that they are on, and no arrow says where they face."""
    source = real_data / "gltf/CesiumMan.glb"
    table = tmp_path / "none.toml"
    table.write_text("".join(f'"{name}" = "none"\n' for name in load(source).motion.skeleton.names))
    imported = load(source, Reading(roles=str(table)))
    assert set(joint_groups(imported.motion.character)) == {GROUPS.index("no role")}
    assert min(role_sheet(imported).size) > 600
