"""From a data set's training clips to material: what is kept, what is left out, and windows of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from retarget_bench.api import Dataset, DatasetCard
from retarget_bench.api.completing import complete
from retarget_bench.errors import NotSupported
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.clips import by_character, training_clips
from retarget_bench.training.data import TrainingData
from retarget_bench.training.gather import clips_of, gather

TOYS = Path(__file__).parent / "learned_toys"


@pytest.fixture(autouse=True)
def _toys(monkeypatch):
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))
    for name in ("odd_clips", "rooted"):
        registry.add_file(TOYS / f"{name}.py")


def gathered(method: str = "rooted", data: str = "odd_clips", jobs: int = 1) -> TrainingData:
    return gather(Spec.parse(data), Spec.parse(method), 30.0, jobs, lambda done, total: None)


@pytest.fixture(scope="module")
def training_data():
    for name in ("odd_clips", "rooted"):
        registry.add_file(TOYS / f"{name}.py")
    return gathered()


def test_clips_are_kept_at_the_rate_asked_for_where_the_body_is_the_same(training_data):
    """Longer shins are another body; another rest pose with the same bones is not."""
    assert {name: [clip.name for clip in clips] for name, clips in training_data.clips.items()} == {
        "anna": ["anna-0", "anna-2"],
        "bert": ["bert-0", "bert-1"],
    }
    assert [clip.frames for clip in training_data.clips["bert"]] == [6, 15]
    assert training_data.structures == {"toy": ("anna", "bert")}
    assert list(training_data.notes) == ["not trained on 1 clip of anna, in which the body is another one"]
    assert training_data.frames == 6 + 4 + 6 + 15
    every_second = training_data.clips["bert"][0].arrays["root"][:, 0]
    assert every_second.tolist() == [0, 2, 4, 6, 8, 10]


def test_processes_find_the_same(training_data):
    again = gathered(jobs=2)
    assert list(again.clips) == list(training_data.clips)
    for name, clips in again.clips.items():
        for clip, other in zip(clips, training_data.clips[name], strict=True):
            assert all(np.array_equal(array, other.arrays[key]) for key, array in clip.arrays.items())


def test_whom_a_method_cannot_take_is_named(training_data):
    del training_data
    data = gathered("rooted[without=bert]")
    assert list(data.clips) == ["anna"]
    assert "not trained on bert: too shy" in data.notes
    with pytest.raises(NotSupported, match=r"odd_clips has no motion that rooted.* trained on: too shy"):
        gathered("rooted[without='anna bert']")


def test_clips_that_cannot_be_had_stop_it_with_the_character():
    with pytest.raises(NotSupported, match="anna: its training motion cannot be had: IndexError"):
        gathered(data="odd_clips[fails=true]")


def test_a_data_set_without_training_motion_says_so():
    class Bare:
        card = DatasetCard("bare", "", "", "", "")
        label = " bare "

    class Empty(Bare):
        def training(self):
            return {"body22": {}}

    for data in (Bare(), Empty()):
        with pytest.raises(NotSupported, match=r"^bare has no training motion; see Dataset"):
            training_clips(complete(data, Dataset))


def test_progress_is_told(tmp_path):
    progress = []
    names = list(training_clips(registry.create("datasets", "odd_clips"))["toy"])
    common = {"dataset": Spec("odd_clips"), "method": Spec("rooted"), "fps": 60.0, "folder": tmp_path}
    common["augmentation"] = None
    by_character(clips_of, names, common, 1, lambda *at: progress.append(at))
    assert progress == [(0, 2), (1, 2), (2, 2)]


# ---------------------------------------------------------------------------------------------- windows
def test_statistics_are_over_every_frame_once(training_data):
    stacked = training_data.stacked("root", ["anna"])
    assert len(stacked) == 6 + 4
    assert len(training_data.stacked("root")) == training_data.frames


def test_motion_lies_on_disk_and_leaves_nothing_there(tmp_path, monkeypatch):
    """Arrays are mapped into memory, in the cache folder or, where that cannot be written, elsewhere."""
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "cache"))
    data = gather(Spec("odd_clips"), Spec("rooted"), 60.0, 1, lambda *at: None)
    array = next(iter(data.clips.values()))[0].arrays["root"]
    while isinstance(array.base, np.ndarray):
        array = array.base
    assert isinstance(array, np.memmap)
    assert list((tmp_path / "cache" / "training").iterdir()) == []
    (tmp_path / "file").touch()
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "file"))
    assert gather(Spec("odd_clips"), Spec("rooted"), 60.0, 1, lambda *at: None).hash == data.hash
