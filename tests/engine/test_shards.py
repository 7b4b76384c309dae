"""Shards: whoever carries them out, in whatever order and however often, the results are the same."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import executing
import pytest
from executing import Shuffled, plan, run
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import executors, runner, shard_work, shards
from retarget_bench.evaluation.shards import StoredPlan
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store

pytestmark = pytest.mark.usefixtures("in_process")


@pytest.fixture(autouse=True)
def shuffled(monkeypatch) -> Iterator[type[Shuffled]]:
    """An engine ``shuffled``, small shards, and no process."""
    executing.know_toys()
    executing.small_shards(monkeypatch)
    monkeypatch.setitem(executors.ENGINES, "shuffled", Shuffled)
    monkeypatch.setattr(runner, "POLL", 0.0)
    monkeypatch.setattr(runner, "PATIENCE", 0.0)
    return Shuffled


class Interrupted(Shuffled):
    """The run is interrupted after its shards were carried out, and before it sees what they answered."""

    def run(self, folder, numbers):
        list(super().run(folder, numbers))
        raise KeyboardInterrupt
        yield


def stored(root: Path, *methods: str, **changes) -> StoredPlan:
    """A plan whose shards nobody has carried out."""

    with pytest.raises(BenchError, match=r"the shards 0 to \d+ are to be carried out: bench work "):
        run(root, "hand", *methods, **changes)
    (folder,) = (root / ".shards").iterdir()
    return StoredPlan(folder)


# ----------------------------------------------------------------------------------------- the same results
def test_results_are_the_same_bytes_in_any_order_and_twice(tmp_path, shuffled):
    here, there = run(tmp_path / "local"), run(tmp_path / "shuffled", "shuffled")
    assert len(shuffled.submitted) > 5
    assert len([name for name in here if ".seed-1" in name and name.endswith(".npz")]) == 11  # ten cases
    assert there == here
    assert not (tmp_path / "shuffled" / ".shards").exists()


def test_what_a_run_does_not_see_the_next_one_takes_up(tmp_path, monkeypatch):
    monkeypatch.setitem(executors.ENGINES, "interrupted", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "again", "interrupted")
    totals = []
    runner.run(plan(tmp_path / "again"), lambda done, total: totals.append(total))
    assert set(totals) <= {0}
    assert executing.files(tmp_path / "again") == run(tmp_path / "local")


def test_damaged_answers_are_computed_anew(tmp_path):
    stored_plan = stored(tmp_path / "again")
    (stored_plan.folder / "parts").mkdir()
    (stored_plan.folder / "parts" / "0-torn.jsonl").write_text("[0, {")
    assert run(tmp_path / "again") == run(tmp_path / "local")


def test_answers_of_a_run_with_other_keys_are_not_taken_up(tmp_path, monkeypatch):
    monkeypatch.setitem(executors.ENGINES, "interrupted", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "again", "interrupted", metrics=("position", "smoothness"))
    assert run(tmp_path / "again") == run(tmp_path / "local")


def test_a_lost_shard_costs_a_sentence_and_its_own_answers(tmp_path, monkeypatch):
    class Lossy(Shuffled):
        def run(self, folder, numbers):
            yield 0, "its node died"
            yield from super().run(folder, numbers[1:])

    monkeypatch.setitem(executors.ENGINES, "lossy", Lossy)
    with pytest.raises(BenchError, match=r"1 of \d+ shards were lost; shard 0: its node died\. What was"):
        run(tmp_path / "lossy", "lossy")
    left = []
    runner.run(plan(tmp_path / "lossy"), lambda done, total: left.append(total))
    assert 0 < left[0] < 25
    assert executing.files(tmp_path / "lossy") == run(tmp_path / "local")


def test_a_shard_that_ends_without_its_answers_is_lost(tmp_path, monkeypatch):
    class Silent(Shuffled):
        def run(self, folder, numbers):
            return ((number, "") for number in numbers)

    monkeypatch.setitem(executors.ENGINES, "silent", Silent)
    with pytest.raises(BenchError, match=r"shard 0: it ended, but not all of its answers"):
        run(tmp_path, "silent")


# ------------------------------------------------------------------------------------------------- by hand


def test_a_machine_with_other_code_versions_or_data_says_so(tmp_path):
    stored_plan = stored(tmp_path)
    path = stored_plan.folder / "plan.json"
    facts = json.loads(path.read_text())
    for name in ("numpy", "method copy_rotations", "data set toy_cases"):
        path.write_text(json.dumps(facts | {"common": facts["common"] | {name: "other"}}))
        with pytest.raises(BenchError, match=rf"has {name} .* where the run was planned with other; all"):
            shard_work.ShardWork(stored_plan.folder, tmp_path, check=True)


def test_errors_of_stored_plans_are_sentences(tmp_path):
    stored_plan = stored(tmp_path)
    with pytest.raises(BenchError, match="has no shard 99"):
        stored_plan.tasks(99)
    with pytest.raises(FileError, match="is not part of a stored plan"):
        StoredPlan(tmp_path / "nowhere" / "x").tasks(0)
    path = stored_plan.folder / "plan.json"
    facts = json.loads(path.read_text())
    path.write_text(json.dumps(facts | {"plan": {**facts["plan"], "strange": 1}}))
    with pytest.raises(FileError, match="another version of retarget-bench"):
        StoredPlan(stored_plan.folder).plan  # noqa: B018
    path.unlink()
    with pytest.raises(BenchError, match="is gone: its run has ended"):
        stored_plan.writer(0)


def test_paths_of_data_are_stored_in_full(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("motions").mkdir()
    spec = bound.dataset(Spec.parse("folder[root=motions]")).located
    assert spec == Spec("folder", {"root": str(tmp_path / "motions")})


# ------------------------------------------------------------------------------------------------- cutting
@dataclass(frozen=True)
class Split:
    """As much of an evaluation unit as cutting needs."""

    name: str
    lengths: tuple[int, ...]
    together: bool = False
    dataset: str = "made"
    split: str = "cross"
    plan: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(seed=0), compare=False)

    @cached_property
    def infos(self):
        numbered = ((str(number), frames) for number, frames in enumerate(self.lengths))
        return [
            CaseInfo(name, "retarget", "cross", "a", "b", name, "", frames) for name, frames in numbered
        ]

    @cached_property
    def batches(self):
        size = 4 if self.together else 1
        ids = [info.id for info in self.infos]
        return [tuple(ids[at : at + size]) for at in range(0, len(ids), size)]


@given(
    st.lists(st.integers(1, 5000), min_size=1, max_size=300),
    st.sets(st.integers(0, 299)),
    st.integers(1, 100_000),
)
def test_shards_hold_all_that_is_lacking_once_and_none_is_too_large(lengths, done, largest):
    units = [Split("one", tuple(lengths)), Split("batches", tuple(lengths), together=True)]
    answered = {str(number) for number in done}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "LARGEST", largest)
        parts = list(shards.cut({units[0]: answered, units[1]: ()}))
    assigned = [
        (u, c) for shard in parts for task in shard for u, cases in task.lacking.items() for c in cases
    ]
    ids = [str(number) for number in range(len(lengths))]
    assert sorted(assigned) == sorted([(0, c) for c in ids if c not in answered] + [(1, c) for c in ids])
    for shard in parts:
        sizes = [sum(lengths[int(c)] for cases in task.lacking.values() for c in cases) for task in shard]
        assert len(shard) == 1 or sum(sizes) <= largest
        assert all(set(cases) <= set(task.cases) for task in shard for cases in task.lacking.values())


# ------------------------------------------------------------------------------------------------- options
@pytest.mark.parametrize(
    ("executor", "words"),
    [
        ("rai", "no executor is called rai; there are local, ray, slurm, hand"),
        ("local[cpus=2]", "the executor local takes no parameters"),
        ("ray[gpu=2]", "did you mean gpus"),
        ("ray[", "expected a parameter's name"),
    ],
)
def test_an_executor_that_there_is_not_is_told(tmp_path, executor, words):
    with pytest.raises(BenchError) as caught:
        run(tmp_path, executor)
    assert words in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_an_executor_is_no_part_of_keys(tmp_path):
    run(tmp_path, "shuffled", "copy_rotations")
    (header,) = [store.read_header(place.header) for place in store.find_results(tmp_path)]
    run(tmp_path, "local", "copy_rotations")
    (again,) = [store.read_header(place.header) for place in store.find_results(tmp_path)]
    assert again == header  # its date included: nothing was computed
