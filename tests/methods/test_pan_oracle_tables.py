"""Tables, weights and sums that stand beside the answers of PAN's authors: ours say the same."""

from __future__ import annotations

# ruff: noqa: F811  (fixtures of another file are parameters here)
import numpy as np
import pan_oracle
import pytest
from pan_oracle import below
from test_pan_oracles import LEGS, PEOPLE, Case, folder, legs, people  # noqa: F401  (fixtures)

from retarget_bench.methods.pan import Pan, losses
from retarget_bench.methods.pan.network import body_parts, convolved_parts, seen_bones

SETTINGS = {
    "people": Pan(variant="released").settings,
    "legs": Pan(variant="released", parts="three").settings,
}


def table(parts: tuple[tuple[int, ...], ...], columns: int) -> np.ndarray:
    matrix = np.zeros((len(parts), columns))
    for row, part in zip(matrix, parts, strict=True):
        row[list(part)] = 1.0
    return matrix


def listed(padded: np.ndarray) -> list[list[int]]:
    return [[int(each) for each in row if each >= 0] for row in padded]


def layout_of(case: Case, name: str):
    return case.structure(name).layout


@pytest.mark.parametrize("name", PEOPLE)
def test_trees_and_parts_are_theirs(people: Case, name: str):
    """Edges, what each carries, the joints of a part, and its edges when masks of convolutions are made."""
    arrays, layout = people.every[name].arrays, layout_of(people, name)
    parents = arrays["structure/fk_topology"].tolist()
    assert list(layout.parents) == parents
    assert [[parents[joint], int(joint)] for joint in layout.leads] == arrays["structure/edges"].tolist()
    assert layout.leads.tolist() == arrays["structure/fk_rotation_map"].tolist()
    joints = [layout.leads[list(part)].tolist() for part in layout.parts]
    assert joints == [[each for each in part if each] for part in listed(arrays["body_parts/joints"])]
    shifted = [list(part[:-1]) for part in convolved_parts(layout, SETTINGS["people"].design)]
    assert shifted == listed(arrays["body_parts/as_left_by_the_encoder"])


@pytest.mark.parametrize("name", PEOPLE)
def test_parts_read_and_write_what_theirs_do(people: Case, name: str):
    """Of the encoder of skeletons' columns, that of the root has no length, and ours no weights."""
    arrays, layout = people.every[name].arrays, layout_of(people, name)
    design, slots = SETTINGS["people"].design, layout.edges + 1
    actual = table(convolved_parts(layout, design), slots)
    np.testing.assert_array_equal(actual, arrays["mask/part_by_slot_convolutions"])
    bones = tuple(tuple(edge + 1 for edge in part) for part in seen_bones(layout, design))
    reference = arrays["mask/part_by_column_skeleton_encoder"]
    np.testing.assert_array_equal(table(bones, slots)[:, 1:], reference[:, 1:])
    assert not arrays["structure/offsets"][:, 0].any()


@pytest.mark.parametrize("name", LEGS)
def test_parts_of_people_and_dogs_read_and_write_what_theirs_do(legs: Case, name: str):
    arrays, layout = legs.every[name].arrays, layout_of(legs, name)
    design = SETTINGS["legs"].design
    actual = table(convolved_parts(layout, design), layout.edges + 1)
    np.testing.assert_array_equal(actual, arrays["mask/part_by_slot_convolutions"])
    assert convolved_parts(layout, design) == body_parts(layout, design)
    bones = tuple(tuple(joint - 1 for joint in part) for part in seen_bones(layout, design))
    reference = arrays["mask/part_by_offset_skeleton_encoder"]
    np.testing.assert_array_equal(table(bones, layout.edges - 1), reference)
    joints = legs.module._objective._tensors["joints", pan_oracle._key(legs.module, name)].tolist()
    inner = [joint for joint in joints if joint < layout.edges]
    assert sorted(inner) == sorted(arrays["structure/scored_joints"].tolist())


def test_weights_between_people_are_theirs(people: Case):
    """Positions and the root count inside the reconstruction, and positions inside the cycle."""
    reference, weights = below(people.step, "weight/"), SETTINGS["people"].weights
    rec, cycle = reference["lambda_rec"], reference["lambda_cycle"]
    actual = {
        "rec_quaternion": weights.edges / rec,
        "rec_global": weights.root / rec,
        "rec_position": weights.kinematic / rec,
        "lambda_rec": 1.0,
        "lambda_cycle": weights.cycle,
        "ee": weights.ends,
        "gan": weights.adversarial,
        "ee_at_rest": losses.RESTING,
        "ee_rest_threshold": losses.NEAR,
    }
    assert actual == {name: pytest.approx(float(each), rel=1e-6) for name, each in reference.items()}
    assert weights.again_positions == pytest.approx(float(cycle))


def test_weights_between_legs_are_theirs(legs: Case):
    reference, weights = below(legs.step, "weight/"), SETTINGS["legs"].weights
    actual = {
        "rec_quaternion": weights.edges,
        "rec_global": weights.moves,
        "rec_position": weights.kinematic,
        "lambda_rec": 1.0,
        "lambda_cycle": weights.cycle,
        "lambda_retar_vel": weights.velocity,
        "gan": weights.adversarial,
    }
    assert actual == {name: pytest.approx(float(each), rel=1e-6) for name, each in reference.items()}
    assert weights.again_positions == pytest.approx(float(reference["lambda_cycle"]))
