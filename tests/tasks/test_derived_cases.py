"""Cases of derived tasks: which there are, what they ask, that they never move; bodies of some joints."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from retarget_bench.errors import BenchError, NotSupported, SkeletonError
from retarget_bench.evaluation import plan
from retarget_bench.evaluation.tasks import canonical, definitions
from retarget_bench.evaluation.tasks.definitions import MAJOR_ROLES, reduced
from retarget_bench.motion import kinematics
from retarget_bench.motion.motion import Motion, Positions
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from tests.tasks.toys.toy_people import TREE, body

CHI3 = 2 * np.sqrt(2 / np.pi)
"""Mean length of a vector of three standard normal numbers."""
GOLDEN_SEED = 272058593699020684
"""The first fifteen hex digits of the SHA-256 of "0", "denoise" and the case's id, on a line each."""
GOLDEN_NOISE = [0.5797474540533023, 0.7265651232772817, -1.3287274890635294]
GOLDEN_JOINTS = (2, 6, 12, 13, 15, 21)


def task(name: str, **parameters: str | int) -> Spec:
    """A task as it is stored."""
    return canonical(Spec(name, parameters))


@pytest.fixture(autouse=True)
def _toys():
    registry.add_file(Path(__file__).parent / "toys" / "toy_people.py")
    registry.add_file(Path(__file__).parents[1] / "engine" / "toys" / "toy_cases.py")


def cases(task: str, data: str = "toy_people"):
    derived = plan.data_of(bound.dataset(Spec.parse(data)), task)
    return [derived.load(info) for info in derived.cases(Spec.parse(task).name, "self")]


def test_reconstruct_asks_every_clean_motion_once():
    derived = cases("reconstruct")
    assert [case.info.id for case in derived] == [
        "people/ann>ann/clip 0", "people/ann>ann/clip 1", "people/bob>bob/clip 0", "people/bob>bob/clip 1",
    ]  # fmt: skip
    for case in derived:
        assert isinstance(case.source, Motion)
        assert case.source is case.reference
        assert case.target is case.source.character
        assert (case.info.task, case.info.split, case.conditions) == ("reconstruct", "self", {})


def test_without_self_cases_the_sources_are_the_clean_motions():
    derived = cases("reconstruct", "toy_cases")
    assert sorted(case.info.id for case in derived) == sorted(
        f"toy/{name}>{name}/clip {n}" for name in ("small", "tall") for n in range(3)
    )
    for case in derived:
        assert case.reference is case.source
        assert case.source.character.name == case.info.source == case.info.target


def test_noise_has_the_deviation_that_is_asked_for_on_every_coordinate():
    for case in cases("denoise[levels='0,1,5']"):
        noise = case.source.positions - case.reference.positions
        assert isinstance(case.source, Positions)
        sigma = case.conditions["noise"]
        if sigma == 0:
            assert not noise.any()
            continue
        count = noise.size
        assert noise.mean() == pytest.approx(0, abs=4 * sigma / np.sqrt(count))
        assert noise.std() == pytest.approx(sigma, rel=4 / np.sqrt(2 * count))
        assert stats.kstest(noise.ravel() / sigma, "norm").pvalue > 1e-4
        length = np.linalg.norm(noise, axis=-1)
        assert length.mean() == pytest.approx(CHI3 * sigma, rel=4 * 0.422 / np.sqrt(length.size))


def test_noise_of_other_cases_is_other_noise():
    derived = cases("denoise[levels=5]")
    drawn = [case.source.positions - case.reference.positions for case in derived]
    for a, b in pairwise(drawn):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 5 / np.sqrt(a.size)


def test_a_proportion_of_joints_is_given_where_they_are_and_fingers_never():
    for case in cases("joint-completion[levels='0.1,0.5,1']"):
        body = list(case.reference.skeleton.names)
        assert len(body) == 16
        assert "LeftHandIndex1" not in body
        count = {0.1: 2, 0.5: 8, 1.0: 16}[case.conditions["proportion"]]
        assert case.conditions == {"proportion": case.conditions["proportion"], "joints": count, "of": 16}
        assert len(case.source.skeleton) == count
        at = [body.index(name) for name in case.source.skeleton.names]
        assert np.array_equal(case.source.positions, case.reference.positions[:, at])
        if count == 16:
            assert case.source.character is case.target


def test_joints_are_drawn_alike():
    counts = np.zeros(12)
    for number in range(3000):
        chosen = definitions.drawn(number, 12, 3)
        assert len(set(chosen)) == 3
        counts[list(chosen)] += 1
    assert stats.chisquare(counts).pvalue > 1e-3


def test_the_major_joints_are_the_twelve_of_the_paper():
    for case in cases("joint-completion[levels=major]"):
        assert set(case.source.character.roles) == set(MAJOR_ROLES)
        assert len(MAJOR_ROLES) == 12
        assert case.info.id.endswith("/joints-major")
        assert definitions.level_name(case.conditions) == "major"


def test_bodies_without_all_major_joints_are_not_asked_for_them():
    derived = plan.data_of(bound.dataset(Spec.parse("toy_cases")), "joint-completion[levels='major,0.5']")
    ids = [info.id for info in derived.cases("joint-completion", "self")]
    assert ids
    assert all(each.endswith("joints-0.5") for each in ids)


def test_seeds_and_numbers_stay_what_they_are():
    case = "puppets/ada>ada/walk-001/noise-5cm"
    assert definitions.case_seed(0, "denoise", case) == GOLDEN_SEED
    assert definitions.gaussian(GOLDEN_SEED, (3,)).tolist() == pytest.approx(GOLDEN_NOISE, abs=1e-12)
    assert definitions.drawn(GOLDEN_SEED, 22, 6) == GOLDEN_JOINTS


def test_uniform_numbers_are_those_of_the_raw_bits():
    raw = np.random.Philox(key=5).random_raw(4)
    expected = [((int(each) >> 11) + 0.5) / 2**53 for each in raw]
    assert definitions.uniform(5, 4).tolist() == expected


def test_asking_fewer_levels_or_motions_leaves_the_others_as_they_are():
    every = {case.info.id: case for case in cases("denoise")}
    few = cases("denoise[levels='5,1',motions=2]")
    assert len(few) == 4
    for case in few:
        assert np.array_equal(case.source.positions, every[case.info.id].source.positions)
    assert {case.info.source for case in few} == {"ann", "bob"}


@pytest.mark.parametrize(
    ("name", "levels", "words"),
    [
        ("denoise", "-1", "standard deviations in centimetres, from 0 to 100; got -1"),
        ("denoise", "nan", "got nan"),
        ("denoise", "much", "got much"),
        ("denoise", " , ", "name at least one level"),
        ("joint-completion", "0", "above 0 and at most 1"),
        ("joint-completion", "1.01", "above 0 and at most 1"),
        ("joint-completion", "minor", "or major; got minor"),
        ("reconstruct", "1", "reconstruct has no parameter 'levels'; it has motions"),
    ],
)
def test_hostile_levels_are_told(name, levels, words):
    with pytest.raises(BenchError, match=words):
        task(name, levels=levels)


@pytest.mark.parametrize(
    ("task", "words"),
    [
        ("inpaint", "no task 'inpaint'; tasks are retarget, points, reconstruct, denoise, joint-"),
        ("denoise[level=5]", "no parameter 'level'; it has levels and motions"),
        ("reconstruct[levels=5]", "no parameter 'levels'"),
        ("denoise[motions=-2]", "motions is -2; it is a number of motions, at least 1"),
        ("denoise[motions=lots]", "motions is 'lots'; it is a number of motions"),
    ],
)
def test_hostile_tasks_are_told(task, words):
    with pytest.raises(BenchError, match=words):
        plan.data_of(bound.dataset(Spec.parse("toy_people")), task)


def test_usual_parameters_are_left_out_and_others_written_one_way():
    assert str(task("denoise", levels="0, 1.0,2,3,4,5,6,8,10")) == "denoise"
    written = task("joint-completion", levels="0.50,major, 0.5", motions=3)
    assert written == task("joint-completion", levels="0.5,major", motions=3)
    assert task("joint-completion", levels="0.5").slug != task("joint-completion", levels="0.6").slug


def test_the_content_tells_tasks_and_levels_apart():
    names = ("reconstruct", "denoise", "denoise[levels=5]", "joint-completion")
    contents = {plan.data_of(bound.dataset(Spec.parse("toy_people")), name).content for name in names}
    assert len(contents) == len(names)


# ----------------------------------------------------------------- characters of which some joints are left
BODY = body("ann", 1.0)
NAMES = tuple(TREE)


def in_reference_pose(character) -> np.ndarray:
    return kinematics.forward(character.skeleton, character.reference_pose, np.zeros(3))[0]


@given(st.sets(st.integers(0, len(NAMES) - 1), min_size=1))
def test_any_joints_make_a_body(joints):
    small = reduced(BODY, sorted(joints))
    assert small.skeleton.names == tuple(NAMES[j] for j in sorted(joints))
    assert small.roles == tuple(BODY.roles[j] for j in sorted(joints))
    assert (small.measures, small.structure) == (BODY.measures, BODY.structure)
    small_places, body_places = in_reference_pose(small), in_reference_pose(BODY)[sorted(joints)]
    assert np.allclose(small_places - small_places[0], body_places - body_places[0], atol=1e-12)
    for joint, parent in enumerate(small.skeleton.parents.tolist()):
        name, above = small.skeleton.names[joint], TREE[small.skeleton.names[joint]][0]
        while above is not None and above not in small.skeleton.names:
            above = TREE[above][0]
        if joint == 0:
            assert parent == -1
        else:
            assert small.skeleton.names[parent] == (above or small.skeleton.names[0]), name


def test_all_joints_are_the_body_itself():
    assert reduced(BODY, range(len(NAMES))) is BODY


@pytest.mark.parametrize("joints", [[], [-1, 2], [0, len(NAMES)], [3, 3]])
def test_joints_that_there_are_not_are_told(joints):
    with pytest.raises(SkeletonError, match="keep at least one, each once"):
        reduced(BODY, joints)


def test_a_derived_data_set_has_one_task_and_split():
    derived = plan.data_of(bound.dataset(Spec.parse("toy_people")), "denoise")
    for task, split in (("retarget", "self"), ("denoise", "intra")):
        with pytest.raises(NotSupported, match="has the task denoise and the split self alone"):
            derived.cases(task, split)
