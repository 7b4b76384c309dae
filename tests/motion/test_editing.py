"""All edits together, on whatever bodies and motions there are."""

from __future__ import annotations

import numpy as np
from editing_bodies import body, fingers, gait, hen, twists
from fit_bodies import puppets, random_tree, wiggle
from hypothesis import given
from hypothesis import strategies as st
from tubes import fleshed

from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.editing import edits, legs
from retarget_bench.motion.editing.edits import Edits
from retarget_bench.motion.skeleton import Skeleton
from tests.examples import examples

FULL = body({**fingers(joints=2), **twists(0.0, 0.5)})


def part(seed: int) -> Character:
    """A tenth of all joints cut off with what hangs from them, and a tenth of all bones without length."""
    draw, full, kept = np.random.default_rng(seed), FULL.skeleton, [0]
    for joint in range(1, len(full)):
        if full.parents[joint] in kept and draw.random() < 0.9:
            kept.append(joint)
    parents = np.array([-1, *(kept.index(int(full.parents[joint])) for joint in kept[1:])])
    lengths = np.where(draw.random(len(kept)) < 0.1, 0.0, 1.0)
    offsets = full.offsets[kept] * lengths[:, None]
    return Character.of(f"part {seed}", Skeleton(tuple(full.names[j] for j in kept), parents, offsets))


BODIES = [
    FULL,
    fleshed(0.1),
    hen(wings=True),
    hen(wings=False),
    *puppets().values(),
    random_tree(1, 9),
    *map(part, range(12)),
]


def still(source: Prediction, target: Character) -> Motion:
    """A method: the reference pose along the source's path."""
    return target.motion(
        np.repeat(target.reference_pose[None], source.frames, axis=0), source.root, source.fps
    )


@given(
    pair=st.tuples(st.sampled_from(BODIES), st.sampled_from(BODIES)),
    frames=st.sampled_from([0, 1, 2, 3, 20]),
    edit=st.builds(
        Edits,
        start=st.sampled_from(["keep", "cut", "ease"]),
        root_motion=st.sampled_from(["keep", "in-place", "x", "-z"]),
        hands=st.sampled_from(["relaxed", "open"]),
        arms=st.sampled_from(["clear", "keep"]),
    ),
    seed=st.integers(0, 99),
)
@examples(40)
def test_any_bodies_and_lengths_give_finite_motions_of_as_many_frames(pair, frames, edit, seed):
    source, target = wiggle(pair[0], frames, seed), pair[1]
    answer, notes = edits.edited(source, target, edit, still)
    assert answer.character is target
    assert answer.frames == edits.begun(source, edit).frames
    if edit.start != "cut":
        assert answer.frames == frames
    assert np.isfinite(answer.positions).all()
    np.testing.assert_allclose(np.linalg.norm(answer.rotations, axis=-1), 1.0, atol=1e-9)
    assert all(note.endswith(("are relaxed", "were in the floor")) for note in notes)
    assert edits.compared(source, edit).frames == answer.frames
    assert isinstance(legs.guess(pair[0], target), str)


def test_without_anything_to_edit_the_answer_is_the_method_s():
    plain = body()
    source = gait(plain).at(slice(0, 20))
    answer = gait(plain, 20, seed=3)
    edited, notes = edits.edited(source, plain, edits.USUAL, lambda *_: answer)
    assert notes == []
    np.testing.assert_array_equal(edited.rotations, answer.rotations)
    np.testing.assert_array_equal(edited.root, answer.root)
