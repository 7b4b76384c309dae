"""What all tests share: where real data lies, a cache that is not the user's, one thread."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

# One test a core: threads of torch beside that would spend the time waiting for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# What a shell starts in the background ignores Ctrl-C, and so would the commands that tests interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

from tests import examples  # noqa: F401  (it loads a profile of hypothesis)
from tests.bench_command import bench  # noqa: F401  (a fixture)
from tests.drawn_figures import figures  # noqa: F401  (a fixture)
from tests.in_process import in_process  # noqa: F401  (a fixture)
from tests.viewing.browser import browser, open_page, tabs  # noqa: F401  (fixtures)

LONGEST = (
    "methods/test_learned_methods.py",
    "methods/test_on_a_gpu.py",
    "datasets/test_puppets_quality.py",
    "training/test_train_processes.py",
    "test_testing.py",
    "test_tutorials.py",
    "engine/test_check_mutations.py",
    "engine/test_submission_hostile.py",
    "methods/test_humot_network.py",
    "engine/test_prediction_workers.py",
    "engine/test_bad_plugins.py",
    "test_architecture.py",
    "methods/test_authors_weights.py",
    "test_cli.py",
    "methods/test_correspondence_free.py",
    "motion/test_hostile_files.py",
    "training/test_loop.py",
    "engine/test_code_hash.py",
    "engine/test_probe.py",
    "test_plot.py",
    "test_plugins.py",
    "engine/test_check.py",
    "motion/test_damaged_files.py",
    "motion/test_fbx_read.py",
    "engine/test_submission.py",
    "engine/test_check_red.py",
    "engine/test_environments.py",
    "datasets/test_puppets_frozen.py",
    "test_python_docs.py",
    "tasks/test_task_command.py",
    "methods/test_paired.py",
    "metrics/test_fid_sensitivity.py",
    "engine/test_plot_kinds.py",
    "engine/test_run.py",
    "datasets/test_puppets_training.py",
    "datasets/test_lafan_dog.py",
    "datasets/test_puppets_files.py",
    "test_cli_scans.py",
    "metrics/test_fid.py",
    "datasets/test_folder.py",
    "motion/test_scans.py",
)
"""Files that begin: a worker that were given one of them last would end alone."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the longest files first; the order of the others, and within files, stays."""
    order = {Path(__file__).parent / name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path, len(order)))


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real motion files: ``RETARGET_BENCH_DATA``, else ``shared/data`` in a folder above."""
    if chosen := os.environ.get("RETARGET_BENCH_DATA"):
        if not Path(chosen).is_dir():
            pytest.fail(f"RETARGET_BENCH_DATA={chosen} is not a folder")
        return Path(chosen)
    for folder in Path(__file__).resolve().parents:
        if (folder / "shared" / "data").is_dir():
            return folder / "shared" / "data"
    pytest.skip("no real motion data: set RETARGET_BENCH_DATA to its folder")


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Parsed and generated data goes to a temporary folder of all workers, also in child processes; the
    terminal is nobody's."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    patch = pytest.MonkeyPatch()
    patch.setenv("RETARGET_BENCH_CACHE", str(folder / "cache"))
    patch.delenv("COLUMNS", raising=False)  # workers have one, and printed tables are as wide
    yield
    patch.undo()
