"""Windows of clips: where they begin, and rows that differ in joints."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.gather import StoredClips


def training_data(**joints):
    """A clip of 50 frames and one of 20 for each name; number 100 f + j at joint j of frame f."""

    def clip(name, frames, count):
        values = 100.0 * np.arange(frames)[:, None] + np.arange(count)
        return ClipArrays(name, f"{name}-{frames}", {"values": values[..., None].astype(np.float32)})

    clips = {name: [clip(name, 50, count), clip(name, 20, count)] for name, count in joints.items()}
    return TrainingData({}, clips)


def test_rows_with_fewer_joints_are_followed_by_zeros():
    batch = training_data(a=3, b=5).draw(np.random.default_rng(0), ["a", "b"], 16)
    values = batch.arrays["values"][..., 0]
    assert values.shape == (2, 16, 5)
    assert (values[0, :, 3:] == 0.0).all()
    for row, count in enumerate((3, 5)):
        np.testing.assert_array_equal(np.diff(values[row, :, :count], axis=0), 100.0)
        np.testing.assert_array_equal(np.diff(values[row, :, :count], axis=1), 1.0)


def test_a_clip_that_is_too_short_is_followed_by_zeros():
    batch = training_data(a=2).draw(np.random.default_rng(2), ["a"] * 50, 32)
    short = batch.lengths == 20
    assert short.any()
    assert (batch.lengths[~short] == 32).all()
    assert (batch.arrays["values"][short, 20:] == 0.0).all()
    np.testing.assert_array_equal(batch.mask.sum(1), batch.lengths)


def all_windows(data, name, frames, hop):
    """Every window of a character, clip by clip, by its first number."""
    return [
        clip.arrays["values"][start, 0, 0]
        for clip in data.clips[name]
        for start in range(0, clip.frames - frames + 1, hop)
    ]


@pytest.mark.parametrize("hop", [1, 6])
def test_a_number_chooses_from_all_windows_in_their_order(hop):
    data = training_data(a=1)
    rows = data.draw(np.random.default_rng(5), ["a"] * 200, 16, hop).arrays["values"][:, 0, 0, 0]
    every, numbers = all_windows(data, "a", 16, hop), np.random.default_rng(5)
    assert rows.tolist() == [every[numbers.integers(len(every))] for _ in range(200)]


def test_what_is_left_out_is_never_drawn_and_all_else_is_as_likely():
    def left_out(clip, starts):
        return [start for start in starts if start % 18 == 0] if clip.frames == 50 else ()

    data = training_data(a=1)
    rows = data.draw(np.random.default_rng(6), ["a"] * 4000, 16, 6, left_out).arrays["values"]
    numbers, counts = np.unique(rows[:, 0, 0, 0] / 100.0, return_counts=True)
    assert numbers.tolist() == [0.0, 6.0, 12.0, 24.0, 30.0]  # 0 of the short clip alone
    assert (np.abs(counts - 800) < 5.0 * np.sqrt(800)).all()


def test_stored_clips_may_differ_in_joints_and_arrays(tmp_path):
    written = [clip for clips in training_data(a=3, b=5).clips.values() for clip in clips]
    written.append(
        ClipArrays("c", "other", {"turn": np.ones((7, 2), np.float32), "path": np.zeros((7, 2, 3))})
    )
    read = StoredClips.write(tmp_path / "clips", written).read()
    assert [(clip.character, clip.name) for clip in read] == [
        (clip.character, clip.name) for clip in written
    ]
    for one, other in zip(read, written, strict=True):
        assert list(one.arrays) == list(other.arrays)
        for name, array in other.arrays.items():
            np.testing.assert_array_equal(one.arrays[name], array)
    assert StoredClips.write(tmp_path / "none", []).read() == []
