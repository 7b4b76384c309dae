"""Contact labels against plain loops."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.motion.contact import planted, runs, tidy

labels = st.lists(st.booleans(), min_size=1, max_size=40).map(np.array)


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_labels_follow_the_speed_rule(fps):
    random = np.random.default_rng(0)
    positions = np.cumsum(random.normal(scale=0.003, size=(50, 4, 3)), axis=0)
    labels, height = planted(positions, 1.7, fps), 1.7
    for frame in range(1, 50):
        for joint in range(4):
            moved = np.linalg.norm(positions[frame, joint] - positions[frame - 1, joint])
            assert labels[frame, joint] == (moved / height < 0.003 * 30.0 / fps)
    assert (labels[0] == labels[1]).all()
    assert labels.any()
    assert not labels.all()


def test_one_frame_has_no_speed():
    assert planted(np.zeros((1, 4, 3)), 1.0, 30.0).tolist() == [[False] * 4]


@given(label=labels)
def test_runs_cover_exactly_what_is_true(label):
    covered = np.zeros_like(label)
    last = -1
    for first, end in runs(label):
        assert last < first < end
        covered[first:end] = True
        last = end
    assert (covered == label).all()


@given(label=labels, gap=st.integers(0, 4), shortest=st.integers(0, 5))
def test_tidy_closes_gaps_then_drops_specks(label, gap, shortest):
    expected = label.tolist()
    n, frame = len(expected), 0
    while frame < n:  # gaps between two contacts
        end = frame
        while end < n and not label[end]:
            end += 1
        if frame > 0 and end < n and 0 < end - frame <= gap:
            expected[frame:end] = [True] * (end - frame)
        frame = max(end, frame) + 1
    closed = np.array(expected)
    tidied = tidy(label, gap, shortest)
    for first, end in runs(closed):
        assert tidied[first:end].all() == (end - first >= shortest)
        assert tidied[first:end].any() == (end - first >= shortest)
    assert not tidied[~closed].any()
