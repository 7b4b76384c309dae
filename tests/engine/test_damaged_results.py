"""Files that were cut, edited or lost give no number, and a run makes them again; one run at a time."""

from __future__ import annotations

import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from small_plans import asked, carry_out
from stored import store as made_up
from stored import unchecked

from retarget_bench.analysis.summary import split_summaries
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import runner, set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.evaluation.shard_work import ShardWork
from retarget_bench.files import LOCK, locked
from retarget_bench.results import case_metadata, store
from retarget_bench.results.paths import ARRAYS, CASES, ROWS, SETS

pytestmark = pytest.mark.usefixtures("in_process", "toys")


def cut(path: Path) -> None:
    """A file without its last line, or its last bytes."""
    content = path.read_bytes()
    end = content[:-1].rindex(b"\n") + 1 if path.suffix == ".csv" else len(content) - 10
    path.write_bytes(content[:end])


def edit(path: Path) -> None:
    """A file of the same size with another last digit."""
    content = path.read_bytes()
    path.write_bytes(content[:-2] + (b"7" if content[-2:-1] != b"7" else b"3") + content[-1:])


@pytest.mark.parametrize("end", [ROWS, ARRAYS, CASES])
@pytest.mark.parametrize("harm", [cut, edit, Path.unlink])
def test_what_is_not_as_it_was_written_is_named_and_made_again(tmp_path, monkeypatch, end, harm):
    (results,) = carry_out(tmp_path, "toy_method")
    place = results.paths
    path, expected = place.file(end), place.file(end).read_bytes()
    harm(path)
    arrays = partial(store.read_results, arrays=True)
    for read in [arrays] if end == ARRAYS else [store.read_results, lambda at: split_summaries([at])]:
        with pytest.raises(FileError, match="bench run, with the same options, write it anew") as caught:
            read(place)
        assert caught.value.path == path
    monkeypatch.setattr(ShardWork, "_predicted", None)  # not asked: stored predictions are scored
    carry_out(tmp_path, "toy_method")
    assert path.read_bytes() == expected


@pytest.mark.parametrize("harm", [cut, edit, Path.unlink])
def test_metadata_of_cases_are_checked_and_made_again(tmp_path, harm):
    (results,) = carry_out(tmp_path, "toy_method")
    path = case_metadata.path_of(results.paths)
    expected, metadata = path.read_bytes(), case_metadata.read(results.paths)
    assert metadata.legs
    harm(path)
    if path.exists():
        with pytest.raises(FileError, match="bench run writes it anew"):
            case_metadata.read(results.paths)
    carry_out(tmp_path, "toy_method")
    assert path.read_bytes() == expected
    assert case_metadata.read(results.paths) == metadata


def test_other_line_ends_and_headers_without_checksums_are_no_damage(tmp_path):
    place = made_up(tmp_path, "intra", "m", [("a>b", "c", {"mpjpe_h.world": 1.0})])
    place.rows.write_bytes(place.rows.read_bytes().replace(b"\n", b"\r\n"))
    assert store.read_results(place).entries[0].values == {"mpjpe_h.world": 1.0}
    unchecked(tmp_path)
    edit(place.rows)
    assert store.read_results(place).entries


# ------------------------------------------------------------------------------------------ one at a time
def test_a_second_run_in_the_same_folder_is_refused_and_readers_are_not(tmp_path):
    carry_out(tmp_path, "toy_method")
    messages = []

    def watch(done: int, total: int) -> None:
        if not messages:
            with pytest.raises(BenchError) as caught:
                runner.run(asked(tmp_path, "toy_method"), lambda *_: None)
            messages.append(str(caught.value))
            assert split_summaries(store.find_results(tmp_path))

    runner.run(asked(tmp_path, "toy_method", overwrite="always"), watch)
    assert messages == [
        f"another run is writing to {tmp_path}; wait until it has ended, or give another folder"
    ]
    assert not (tmp_path / LOCK).exists()


def test_the_lock_of_a_killed_process_is_none(tmp_path):
    script = (
        "import sys, time\nfrom pathlib import Path\nfrom retarget_bench.files import locked\n"
        "with locked(Path(sys.argv[1]), 'busy'):\n    print('held', flush=True)\n    time.sleep(60)\n"
    )
    path = tmp_path / "runs" / LOCK
    with subprocess.Popen([sys.executable, "-c", script, path], stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"held\n"
        with pytest.raises(BenchError, match="busy"), locked(path, "busy"):
            pass
        process.kill()
    assert path.exists()
    with locked(path, "busy"):
        pass
    assert not path.exists()


@pytest.mark.parametrize("harm", [cut, Path.unlink])
def test_values_of_sets_are_checked_too(tmp_path, harm):
    numbers = [("a>b", "c", {"mpjpe_h.world": 1.0})]
    place = made_up(tmp_path, "intra", "m", numbers)
    set_metrics.write(place, [SetValue("fid.structure", "s", 5, 5, value=1.0)])
    made_up(tmp_path, "intra", "m", numbers)
    assert SETS in store.read_header(place.header).files
    harm(place.sets)
    with pytest.raises(FileError, match=r"m\.sets\.csv"):
        split_summaries([place])
